#pragma once

#include <Eigen/Core>
#include <optional>

namespace phantom::geometry {

/// Where the line origin + s·direction meets the triangle (a, b, c), seen from either side: s, negative
/// behind the origin; none if it passes by or runs in the triangle's plane. All in one frame. Real-time safe:
/// yes. (Möller and Trumbore 1997.)
std::optional<double> ray_meets_triangle(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                         const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                         const Eigen::Vector3d& c) noexcept;

}  // namespace phantom::geometry
