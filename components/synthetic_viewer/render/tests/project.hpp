#pragma once

#include <Eigen/Geometry>
#include <optional>

#include "components/synthetic_viewer/render/camera.hpp"

namespace phantom::synthetic_viewer {

/// Pixel coordinates of a point of W (pixel centres at .5, origin top left); nothing for a point that is not
/// in front of the near plane.
inline std::optional<Eigen::Vector2d> project(const Camera& camera, int width_px, int height_px,
                                              const Eigen::Vector3d& p_W_m) {
  const double aspect = static_cast<double>(width_px) / height_px;
  const Eigen::Vector4d clip = projection_matrix(camera, aspect) * view_matrix(camera) * p_W_m.homogeneous();
  if (!(clip.w() >= camera.near_m)) return std::nullopt;
  return Eigen::Vector2d((clip.x() / clip.w() + 1) / 2 * width_px, (1 - clip.y() / clip.w()) / 2 * height_px);
}

}  // namespace phantom::synthetic_viewer
