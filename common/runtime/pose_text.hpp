#pragma once

#include <string>

#include "common/core/status.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::runtime {

/// "x y z roll pitch yaw", metres and degrees, with blanks or commas between, as command lines have it.
core::Expected<geometry::Pose> parse_pose(const std::string& text);
/// The same backwards, with blanks.
std::string pose_text(const geometry::Pose& X);

}  // namespace phantom::runtime
