#pragma once

#include "common/geometry/mesh.hpp"
#include "common/layers/layers.hpp"

namespace phantom::layers {

/// All of an object's orders by the method that the profile names: outer layers, guard, boundary, interior,
/// layers inside. `mesh_W`: the surface that `solid` was made of, for the `surface` method. `part` is a part
/// of the grid, its lower corner a brick's; the solid must be known around it as far as voxelise_clip() says.
/// Empty if options.go_on said no. Not real-time safe.
workspace::ObjectBricks lay_layers(const geometry::TriangleMesh& mesh_W, const voxelise::SolidVoxels& solid,
                                   const workspace::LayerProfile& profile, const workspace::GridSpec& grid,
                                   const workspace::VoxelBox& part,
                                   const workspace::WorkOptions& options = {});

}  // namespace phantom::layers
