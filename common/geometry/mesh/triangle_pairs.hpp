#pragma once

// Private to this library: finds triangles that pass through each other.

#include "common/geometry/mesh/mesh.hpp"

namespace phantom::geometry::detail {

struct TrianglePairs {
  std::size_t intersecting = 0;
  bool complete = true;
};

/// Returns whether two triangles pass through each other: each has corners on both sides of the other's plane
/// and they share more than a point, or they overlap in a plane. Touching, also within rounding, does not
/// count.
bool triangles_cross(const std::array<Eigen::Vector3d, 3>& s, const std::array<Eigen::Vector3d, 3>& t);

/// Counts crossing pairs of triangles; stops after `max_pairs` tests.
TrianglePairs crossing_pairs(const TriangleMesh& mesh, std::size_t max_pairs);

}  // namespace phantom::geometry::detail
