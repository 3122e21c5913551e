#include "common/fusion/point_projection.hpp"

#include <cmath>
#include <limits>

namespace phantom::fusion {

std::uint16_t whole_mm(double depth_m) noexcept {
  const double depth_mm = std::round(1e3 * depth_m);
  const bool fits = depth_mm >= 1.0 && depth_mm <= std::numeric_limits<std::uint16_t>::max();
  return fits ? static_cast<std::uint16_t>(depth_mm) : std::uint16_t{0};
}

std::vector<std::uint16_t> depths_of_points(std::span<const float> xyz_C_m, const PinholeCamera& camera) {
  std::vector<std::uint16_t> image(camera.pixels(), 0);
  for (std::size_t i = 0; i + 2 < xyz_C_m.size(); i += 3) {
    const double x_m = xyz_C_m[i], y_m = xyz_C_m[i + 1], z_m = xyz_C_m[i + 2];
    const std::uint16_t depth_mm = whole_mm(z_m);
    if (depth_mm == 0) continue;
    const double u_px = std::round(camera.fx_px * x_m / z_m + camera.cx_px),
                 v_px = std::round(camera.fy_px * y_m / z_m + camera.cy_px);
    if (!(u_px >= 0.0 && u_px < camera.width_px && v_px >= 0.0 && v_px < camera.height_px)) continue;
    std::uint16_t& seen = image[static_cast<std::size_t>(v_px) * static_cast<std::size_t>(camera.width_px) +
                                static_cast<std::size_t>(u_px)];
    if (seen == 0 || depth_mm < seen) seen = depth_mm;
  }
  return image;
}

}  // namespace phantom::fusion
