#include "common/layers/layers.hpp"

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
  return distance_bricks(solid, profile, part, options, grid.voxel_size_m.stretch());
}

/// Returns everything that is not interior as a solid of its own. Its outer layers are the body's inner
/// layers.
voxelise::SolidVoxels hollow(const voxelise::SolidVoxels& solid) {
  voxelise::SolidVoxels rest;
  rest.box = solid.box;
  rest.boundary = workspace::BitVolume(solid.box.size);
  rest.inside = workspace::BitVolume(solid.box.size);
  for (std::int32_t z = 0; z < solid.box.size[2]; ++z) {
    for (std::int32_t y = 0; y < solid.box.size[1]; ++y) rest.inside.set_run(y, z, 0, solid.box.size[0]);
  }
  const workspace::BitVolume interior = solid.interior();
  for (std::size_t i = 0; i < interior.words().size(); ++i) rest.inside.words()[i] &= ~interior.words()[i];
  return rest;
}

/// Returns how often StretchedDistance goes over a voxel: for each row in reach of its slice and of the
/// slices around its brick, and for each of those.
double passes_of(int reach_vox, const Eigen::Vector3d& stretch) {
  const double along_y = 2.0 * reach_vox / stretch.y() + 1.0, along_z = 2.0 * reach_vox / stretch.z() + 1.0;
  return along_y * (1.0 + along_z / workspace::kBrickEdge) + along_z;
}

/// Returns the work of growing each layer by its element, beside going over all voxels: for each row of 64
/// voxels, every row of the element.
std::uint64_t dilation_steps(std::uint64_t voxels, const workspace::LayerProfile& profile) {
  constexpr std::uint64_t kVoxelsOfARow = 64, kRowsOfAStep = 40;
  std::uint64_t rows = element_rows(workspace::ShapingElement::kSphere, profile.guard_vox);
  for (const int thickness : profile.thickness_vox) rows += element_rows(profile.element, thickness);
  return voxels / kVoxelsOfARow * rows / kRowsOfAStep;
}

}  // namespace

std::uint64_t layer_steps(const voxelise::SolidVoxels& solid, const workspace::LayerProfile& profile,
                          const workspace::VoxelBox& part, const Eigen::Vector3d& stretch) {
  constexpr std::uint64_t kVoxelsOfAStep = 8;
  if (solid.box.empty()) return 0;
  const workspace::VoxelBox reached = solid.box.grown(profile.reach_vox()).intersection(part);
  const auto voxels = static_cast<std::uint64_t>(reached.voxel_count());
  const bool dilation = profile.method == workspace::LayerMethod::kDilation;
  const std::size_t passes =
      1 + (dilation ? profile.thickness_vox.size() : 0) + (profile.inside_thickness_vox.empty() ? 0 : 1);
  double stretched = 0.0;
  if (stretch != Eigen::Vector3d::Ones()) {
    if (profile.method == workspace::LayerMethod::kDistance)
      stretched += passes_of(profile.reach_vox(), stretch);
    if (!profile.inside_thickness_vox.empty()) stretched += passes_of(profile.inside_depth_vox(), stretch);
  }
  const auto all_passes = passes + static_cast<std::size_t>(stretched);
  return voxels * all_passes / kVoxelsOfAStep + (dilation ? dilation_steps(voxels, profile) : 0);
}

void lay_inside(const voxelise::SolidVoxels& solid, const workspace::LayerProfile& profile,
                const workspace::GridSpec& grid, const workspace::VoxelBox& part,
                workspace::ObjectBricks& bricks, const workspace::WorkOptions& options) {
  if (profile.inside_thickness_vox.empty() || solid.box.empty()) return;
  workspace::LayerProfile inwards;
  inwards.thickness_vox = profile.inside_thickness_vox;
  const workspace::ObjectBricks layers =
      distance_bricks(hollow(solid), inwards, part, options, grid.voxel_size_m.stretch());
  for (const workspace::BrickKey key : layers.keys()) {
    const std::int8_t* depth = layers.orders(key);
    const std::int8_t* present = bricks.orders(key);
    if (present == nullptr) continue;
    std::int8_t* orders = nullptr;  // the brick is copied only if something changes
    for (std::size_t i = 0; i < workspace::kBrickVoxels; ++i) {
      if (depth[i] < 1 || depth[i] > workspace::kMaxLayers || present[i] != workspace::kOrderInterior)
        continue;
      if (orders == nullptr) present = orders = bricks.edit(key);
      orders[i] = static_cast<std::int8_t>(-depth[i]);
    }
  }
}

workspace::ObjectBricks lay_layers(const geometry::TriangleMesh& mesh_W, const voxelise::SolidVoxels& solid,
                                   const workspace::LayerProfile& profile, const workspace::GridSpec& grid,
                                   const workspace::VoxelBox& part, const workspace::WorkOptions& options) {
  if (options.budget != nullptr &&
      !options.budget->spend(layer_steps(solid, profile, part, grid.voxel_size_m.stretch())))
    return {};
  workspace::ObjectBricks bricks = outer_layers(mesh_W, solid, profile, grid, part, options);
  const auto go_on = [&](double) { return !options.go_on || options.go_on(1.0); };
  lay_inside(solid, profile, grid, part, bricks, {options.threads, go_on, options.budget});
  return bricks;
}

}  // namespace phantom::layers
