#pragma once

// Private to this library: what can be put right about a mesh before it is voxelised.

#include <vector>

#include "common/geometry/mesh.hpp"
#include "common/geometry/mesh_topology.hpp"
#include "common/voxelise/snapped_mesh.hpp"

namespace phantom::voxelise::detail {

struct MendedMesh {
  std::vector<Corners> triangles;   ///< indices into the points it was made from
  geometry::MeshTopology topology;  ///< of these triangles
  bool closed = false;              ///< a closed surface that faces one way
  std::size_t degenerate = 0, duplicates = 0, turned = 0;
};

/// Joins corners in one place, drops what is repeated or has no extent, turns triangles over that face
/// against the most of their shell.
MendedMesh mend(const SnappedMesh& mesh);

/// Turns closed shells over that face inwards and lie within no other. False if there is none. `mesh_W`: the
/// vertices.
bool turn_stray_shells(const geometry::TriangleMesh& mesh_W, MendedMesh& mended);

}  // namespace phantom::voxelise::detail
