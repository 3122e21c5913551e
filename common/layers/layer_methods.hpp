#pragma once

#include "common/geometry/mesh.hpp"
#include "common/layers/layers.hpp"

namespace phantom::layers {

/// Computes all of an object's orders by the method that the profile names: outer layers, guard, boundary,
/// interior, layers inside. `mesh_W` is the surface from which `solid` was made; only the `surface` method
/// uses it. `part` is a part of the grid whose lower corner is a brick's. The solid must be known around it
/// as far as voxelise_clip() says. Empty if options.go_on returned false. Not real-time safe.
workspace::ObjectBricks lay_layers(const geometry::TriangleMesh& mesh_W, const voxelise::SolidVoxels& solid,
                                   const workspace::LayerProfile& profile, const workspace::GridSpec& grid,
                                   const workspace::VoxelBox& part,
                                   const workspace::WorkOptions& options = {});

}  // namespace phantom::layers
