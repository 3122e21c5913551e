#pragma once

#include <Eigen/Core>
#include <optional>

namespace phantom::geometry {

/// Returns s where the line origin + s·direction meets the triangle (a, b, c), from either side; s is
/// negative behind the origin. Returns none if the line misses the triangle or is parallel to its plane. All
/// in one frame. Real-time safe: yes. (Möller and Trumbore 1997.)
std::optional<double> ray_meets_triangle(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                         const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                         const Eigen::Vector3d& c) noexcept;

}  // namespace phantom::geometry
