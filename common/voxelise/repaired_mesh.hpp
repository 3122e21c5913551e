#pragma once

// Private to this library: repairs a mesh before it is voxelised.

#include <vector>

#include "common/geometry/mesh/mesh.hpp"
#include "common/geometry/mesh/mesh_topology.hpp"
#include "common/voxelise/snapped_mesh.hpp"

namespace phantom::voxelise::detail {

struct RepairedMesh {
  std::vector<Corners> triangles;   ///< indices into the points it was made from
  geometry::MeshTopology topology;  ///< of these triangles
  bool closed = false;              ///< whether the triangles form a closed, consistently oriented surface
  std::size_t degenerate = 0, duplicates = 0, turned = 0;
};

/// Joins corners at the same position, drops repeated and degenerate triangles, and turns over triangles that
/// face the other way than most of their shell.
RepairedMesh repair(const SnappedMesh& mesh);

/// Turns over closed shells that face inwards and lie within no other shell. Returns false if there are none.
/// `mesh_W`: provides the vertices.
bool turn_outer_shells(const geometry::TriangleMesh& mesh_W, RepairedMesh& repaired);

}  // namespace phantom::voxelise::detail
