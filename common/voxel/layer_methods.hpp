#pragma once

#include "common/geometry/mesh.hpp"
#include "common/voxel/layers.hpp"

namespace phantom::voxel {

/// All of an object's orders by the method that the profile names: outer layers, guard, boundary, interior,
/// layers inside. `mesh_W`: the surface that `solid` was made of, for the `surface` method. `part` is a part
/// of the grid, its lower corner a brick's; the solid must be known around it as far as voxelise_clip() says.
/// Empty if options.go_on said no. Not real-time safe.
ObjectBricks lay_layers(const geometry::TriangleMesh& mesh_W, const SolidVoxels& solid,
                        const LayerProfile& profile, const GridSpec& grid, const VoxelBox& part,
                        const WorkOptions& options = {});

}  // namespace phantom::voxel
