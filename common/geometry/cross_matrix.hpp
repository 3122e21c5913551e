#pragma once

#include <Eigen/Core>

namespace phantom::geometry {

/// Returns the matrix of the cross product with v: times w, it gives v × w. Real-time safe: yes.
inline Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) noexcept {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

}  // namespace phantom::geometry
