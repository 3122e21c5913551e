#pragma once

#include "common/geometry/mesh.hpp"
#include "common/layers/layers.hpp"

namespace phantom::layers {

/// Lays layers by the `surface` method (spec 1.4): like distance_bricks(), but d is the distance in voxels
/// from a voxel's centre to the nearest point of the mesh itself, however coarse the voxels. Boundary and
/// interior are the solid's. Exact except for rounding in double precision. `mesh_W` is the surface from
/// which `solid` was made. The solid need only be known in `part`, a part of the grid whose lower corner is a
/// brick's. Work space: the mesh as a tree, besides the bricks. Not real-time safe.
workspace::ObjectBricks surface_bricks(const geometry::TriangleMesh& mesh_W,
                                       const voxelise::SolidVoxels& solid,
                                       const workspace::LayerProfile& profile,
                                       const workspace::GridSpec& grid, const workspace::VoxelBox& part,
                                       const workspace::WorkOptions& options = {});

}  // namespace phantom::layers
