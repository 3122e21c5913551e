#pragma once

// Private to this library: triangles that pass through one another.

#include "common/geometry/mesh.hpp"

namespace phantom::geometry::detail {

struct TrianglePairs {
  std::size_t intersecting = 0;
  bool complete = true;
};

/// Whether two triangles pass through one another: each has corners on both sides of the other and they share
/// more than a point, or they overlap in a plane. Touching, also within rounding, does not count.
bool triangles_cross(const std::array<Eigen::Vector3d, 3>& s, const std::array<Eigen::Vector3d, 3>& t);

/// Counts crossing pairs; stops after `max_pairs` were tested.
TrianglePairs crossing_pairs(const TriangleMesh& mesh, std::size_t max_pairs);

}  // namespace phantom::geometry::detail
