#include "common/layers/layer_methods.hpp"

#include "common/layers/dilation.hpp"
#include "common/layers/inside.hpp"
#include "common/layers/surface_layers.hpp"

namespace phantom::layers {
namespace {

workspace::ObjectBricks outer_layers(const geometry::TriangleMesh& mesh_W, const voxelise::SolidVoxels& solid,
                                     const workspace::LayerProfile& profile, const workspace::GridSpec& grid,
                                     const workspace::VoxelBox& part, const workspace::WorkOptions& options) {
  switch (profile.method) {
    case workspace::LayerMethod::kSurface:
      return surface_bricks(mesh_W, solid, profile, grid, part, options);
    case workspace::LayerMethod::kDilation:
      return dilation_bricks(solid, profile, part, options);
    case workspace::LayerMethod::kDistance:
      break;
  }
  return distance_bricks(solid, profile, part, options);
}

}  // namespace

workspace::ObjectBricks lay_layers(const geometry::TriangleMesh& mesh_W, const voxelise::SolidVoxels& solid,
                                   const workspace::LayerProfile& profile, const workspace::GridSpec& grid,
                                   const workspace::VoxelBox& part, const workspace::WorkOptions& options) {
  workspace::ObjectBricks bricks = outer_layers(mesh_W, solid, profile, grid, part, options);
  lay_inside(solid, profile, part, bricks, {options.threads, nullptr});
  return bricks;
}

}  // namespace phantom::layers
