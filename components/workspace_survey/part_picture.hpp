#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/survey/part.hpp"

namespace phantom::workspace_survey {

/// Returns a PNG picture of a part, made from its mesh: seen from its front, right and above, and from
/// behind, left and below, shaded, with its edges and its size. Takes some milliseconds.
std::vector<std::uint8_t> part_picture(const survey::PartModel& part);

/// Returns the size of the box round a part along its own axes, such as "200 x 120 x 80 mm".
std::string size_text(const survey::PartModel& part);

}  // namespace phantom::workspace_survey
