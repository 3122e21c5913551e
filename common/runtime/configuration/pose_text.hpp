#pragma once

#include <string>

#include "common/core/status.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::runtime {

/// Parses "x y z roll pitch yaw" as on command lines, in metres and degrees, separated by blanks or commas.
core::Expected<geometry::Pose> parse_pose(const std::string& text);
/// Returns the pose in the same format, separated by blanks.
std::string pose_text(const geometry::Pose& X);

}  // namespace phantom::runtime
