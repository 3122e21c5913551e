#pragma once

#include <optional>
#include <string>

#include "common/survey/range_head.hpp"

namespace phantom::workspace_survey {

/// What `help` prints: the lines of the assistant's dialogue, and those of one with a head that is steered.
extern const char* const kHelp;
extern const char* const kHeadHelp;

/// Returns the reading of a line: range in mm, pan and tilt in degrees, with spaces or commas between; none
/// if it is something else.
std::optional<survey::Reading> reading_in(const std::string& line);

}  // namespace phantom::workspace_survey
