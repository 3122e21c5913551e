#pragma once

#include <filesystem>
#include <string>

#include "components/workspace_survey/report.hpp"

namespace phantom::workspace_survey {

extern const char* const kCandidatesPage;  ///< the page without its data: candidates.html

/// Returns a page (HTML, one file that needs nothing else) on which a person chooses among what agrees with a
/// measurement (thesis A.2.3, A.3.3): every alternative rendered as the head sees it, to be turned, with what
/// was measured and the library's picture of the part, made from its mesh where the library names none; at
/// most 24, the best match first. What has no pose yet is shown without a button. A click on one says what to
/// type: `pick` and its number; if `pick` is empty, the click is sent to the page that has this one in a
/// frame. `view`: a picture of the cell as it is seen now, to compare; empty: none. Throws core::MissingError
/// or core::ConfigError for a picture that is not there, or is neither PNG nor JPEG of at most 8 MiB.
std::string candidates_page(const SurveyReport& report, const std::string& pick,
                            const std::filesystem::path& view);

}  // namespace phantom::workspace_survey
