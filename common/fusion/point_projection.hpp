#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/fusion/depth_image.hpp"

namespace phantom::fusion {

/// Returns a depth in whole millimetres; 0: there is none, or it is beyond 65.535 m. Real-time safe: yes.
std::uint16_t whole_mm(double depth_m) noexcept;

/// Returns points as the depths that a camera sees, mm by pixel, row by row; 0: no point is there. Each point
/// is in the pixel that its ray passes; of several the nearest is seen. Points beside the image, behind the
/// camera or beyond 65.535 m are left out. `xyz_C_m`: x, y, z of each in the camera's frame, NaN: none; their
/// number is a multiple of three. Pure. Allocates the image.
std::vector<std::uint16_t> depths_of_points(std::span<const float> xyz_C_m, const PinholeCamera& camera);

}  // namespace phantom::fusion
