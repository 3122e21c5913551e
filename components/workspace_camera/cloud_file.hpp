#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "common/core/status.hpp"

namespace phantom::workspace_camera {

/// Greatest number of points of a cloud's file.
inline constexpr std::size_t kMaxCloudPoints = 10'000'000;

/// Reads the points of a file of the Point Cloud Library (PCD 0.7: ascii, binary) or of the Stanford format
/// (PLY 1.0: ascii, binary of either order of octets), which differ by their first words.
/// Returns x, y, z of each point, in the file's unit; NaN where the file has it. Other fields, and what
/// follows the points, are left out. Errors name what is not as the format has it, and what is allowed;
/// everything is checked before the points are allocated. Pure.
core::Expected<std::vector<float>> read_cloud(std::string_view octets);

}  // namespace phantom::workspace_camera
