#pragma once

#include "common/geometry/mesh.hpp"
#include "common/layers/layers.hpp"

namespace phantom::layers {

/// Layers by the `surface` method (spec 1.4): as distance_bricks(), with d the distance in voxels from a
/// voxel's centre to the nearest point of the mesh itself, however coarse the voxels. Boundary and interior
/// are the solid's. Exact but for the rounding of double precision. `mesh_W`: the surface that `solid` was
/// made of, which must be known in `part` alone: a part of the grid, its lower corner a brick's. Work space:
/// the mesh as a tree, besides the bricks. Not real-time safe.
workspace::ObjectBricks surface_bricks(const geometry::TriangleMesh& mesh_W,
                                       const voxelise::SolidVoxels& solid,
                                       const workspace::LayerProfile& profile,
                                       const workspace::GridSpec& grid, const workspace::VoxelBox& part,
                                       const workspace::WorkOptions& options = {});

}  // namespace phantom::layers
