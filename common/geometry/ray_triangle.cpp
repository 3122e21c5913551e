#include "common/geometry/ray_triangle.hpp"

#include <Eigen/Geometry>

namespace phantom::geometry {

std::optional<double> ray_meets_triangle(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                         const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                         const Eigen::Vector3d& c) noexcept {
  const Eigen::Vector3d ab = b - a, ac = c - a;
  const Eigen::Vector3d p = direction.cross(ac);
  const double determinant = ab.dot(p);
  if (determinant == 0) return std::nullopt;
  const Eigen::Vector3d from_a = origin - a;
  const double u = from_a.dot(p) / determinant;
  if (!(u >= 0 && u <= 1)) return std::nullopt;
  const Eigen::Vector3d q = from_a.cross(ab);
  const double v = direction.dot(q) / determinant;
  if (!(v >= 0 && u + v <= 1)) return std::nullopt;
  return ac.dot(q) / determinant;
}

}  // namespace phantom::geometry
