#pragma once

#include <array>
#include <string>

namespace phantom::phantom_session {

/// A language of the report: texts.en.json, texts.de.json.
enum class Language { kEnglish, kGerman };
inline constexpr std::array kLanguages{Language::kEnglish, Language::kGerman};

/// Returns the page's file in the report's folder; each names the other.
const char* report_file(Language language) noexcept;

/// Returns the report as a web page that needs no server: figures in tables, plots, pictures and the sound,
/// by relative links. `summary_json` is the text of summary.json.
std::string report_page(const std::string& summary_json, Language language);

}  // namespace phantom::phantom_session
