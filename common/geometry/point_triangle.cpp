#include "common/geometry/point_triangle.hpp"

#include <algorithm>

namespace phantom::geometry {
namespace {

template <class Vector>
Vector on_segment(const Vector& p, const Vector& a, const Vector& b) {
  using Scalar = typename Vector::Scalar;
  const Vector ab = b - a;
  const Scalar length2 = ab.squaredNorm();
  if (length2 <= Scalar{0}) return a;
  return a + std::clamp((p - a).dot(ab) / length2, Scalar{0}, Scalar{1}) * ab;
}

template <class Vector>
Vector on_triangle(const Vector& p, const Vector& a, const Vector& b, const Vector& c) {
  using Scalar = typename Vector::Scalar;
  const Vector ab = b - a, ac = c - a, ap = p - a;
  const Scalar d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vector bp = p - b;
  const Scalar d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const Vector cp = p - c;
  const Scalar d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const Scalar weight_c = d1 * d4 - d3 * d2, weight_b = d5 * d2 - d1 * d6, weight_a = d3 * d6 - d5 * d4;
  if (weight_a > 0 && weight_b > 0 && weight_c > 0) {
    return a + (weight_b * ab + weight_c * ac) / (weight_a + weight_b + weight_c);
  }
  // Outside the face's region, or a degenerate triangle: the nearest point is on an edge.
  Vector best = on_segment(p, a, b);
  for (const Vector& candidate : {on_segment(p, b, c), on_segment(p, c, a)}) {
    if ((candidate - p).squaredNorm() < (best - p).squaredNorm()) best = candidate;
  }
  return best;
}

}  // namespace

Eigen::Vector3d closest_point_on_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                         const Eigen::Vector3d& b) {
  return on_segment(p, a, b);
}

Eigen::Vector3d closest_point_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                          const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return on_triangle(p, a, b, c);
}

Eigen::Vector3f closest_point_on_triangle(const Eigen::Vector3f& p, const Eigen::Vector3f& a,
                                          const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  return on_triangle(p, a, b, c);
}

}  // namespace phantom::geometry
