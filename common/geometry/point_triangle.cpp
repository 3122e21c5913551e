#include "common/geometry/point_triangle.hpp"

#include <Eigen/Geometry>
#include <algorithm>

namespace phantom::geometry {

Eigen::Vector3d closest_point_on_segment(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                         const Eigen::Vector3d& b) {
  const Eigen::Vector3d ab = b - a;
  const double length2 = ab.squaredNorm();
  if (length2 <= 0.0) return a;
  return a + std::clamp((p - a).dot(ab) / length2, 0.0, 1.0) * ab;
}

Eigen::Vector3d closest_point_on_triangle(const Eigen::Vector3d& p, const Eigen::Vector3d& a,
                                          const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  const Eigen::Vector3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = ab.dot(ap), d2 = ac.dot(ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Eigen::Vector3d bp = p - b;
  const double d3 = ab.dot(bp), d4 = ac.dot(bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const Eigen::Vector3d cp = p - c;
  const double d5 = ab.dot(cp), d6 = ac.dot(cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double weight_c = d1 * d4 - d3 * d2, weight_b = d5 * d2 - d1 * d6, weight_a = d3 * d6 - d5 * d4;
  if (weight_a > 0 && weight_b > 0 && weight_c > 0) {
    return a + (weight_b * ab + weight_c * ac) / (weight_a + weight_b + weight_c);
  }
  // Outside the face's region (or no face at all): one of the edges, whichever is nearest.
  Eigen::Vector3d best = closest_point_on_segment(p, a, b);
  for (const Eigen::Vector3d& candidate :
       {closest_point_on_segment(p, b, c), closest_point_on_segment(p, c, a)}) {
    if ((candidate - p).squaredNorm() < (best - p).squaredNorm()) best = candidate;
  }
  return best;
}

}  // namespace phantom::geometry
