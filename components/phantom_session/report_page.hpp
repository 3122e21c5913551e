#pragma once

#include <string>

namespace phantom::phantom_session {

/// Returns the report as a web page that needs no server: figures in tables, plots, pictures and the sound,
/// by relative links. `summary_json` is the text of summary.json.
std::string report_page(const std::string& summary_json);

}  // namespace phantom::phantom_session
