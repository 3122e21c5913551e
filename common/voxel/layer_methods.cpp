#include "common/voxel/layer_methods.hpp"

#include "common/voxel/dilation.hpp"
#include "common/voxel/inside.hpp"
#include "common/voxel/surface_layers.hpp"

namespace phantom::voxel {
namespace {

ObjectBricks outer_layers(const geometry::TriangleMesh& mesh_W, const SolidVoxels& solid,
                          const LayerProfile& profile, const GridSpec& grid, const VoxelBox& part,
                          const WorkOptions& options) {
  switch (profile.method) {
    case LayerMethod::kSurface:
      return surface_bricks(mesh_W, solid, profile, grid, part, options);
    case LayerMethod::kDilation:
      return dilation_bricks(solid, profile, part, options);
    case LayerMethod::kDistance:
      break;
  }
  return distance_bricks(solid, profile, part, options);
}

}  // namespace

ObjectBricks lay_layers(const geometry::TriangleMesh& mesh_W, const SolidVoxels& solid,
                        const LayerProfile& profile, const GridSpec& grid, const VoxelBox& part,
                        const WorkOptions& options) {
  ObjectBricks bricks = outer_layers(mesh_W, solid, profile, grid, part, options);
  lay_inside(solid, profile, part, bricks, {options.threads, nullptr});
  return bricks;
}

}  // namespace phantom::voxel
