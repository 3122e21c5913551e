#include "common/layers/inside.hpp"

namespace phantom::layers {
namespace {

/// Returns everything that is not interior as a solid of its own. Its outer layers are the body's inner
/// layers.
voxelise::SolidVoxels hollow(const voxelise::SolidVoxels& solid) {
  voxelise::SolidVoxels rest;
  rest.box = solid.box;
  rest.boundary = workspace::BitVolume(solid.box.size);
  rest.inside = solid.interior();
  const int tail = solid.box.size[0] & 63;
  const std::uint64_t last = tail == 0 ? ~std::uint64_t{0} : (std::uint64_t{1} << tail) - 1;
  for (std::int32_t z = 0; z < solid.box.size[2]; ++z) {
    for (std::int32_t y = 0; y < solid.box.size[1]; ++y) {
      std::uint64_t* row = rest.inside.row(y, z);
      const std::size_t words = rest.inside.words_per_row();
      for (std::size_t i = 0; i < words; ++i) row[i] = ~row[i];
      row[words - 1] &= last;
    }
  }
  return rest;
}

}  // namespace

void lay_inside(const voxelise::SolidVoxels& solid, const workspace::LayerProfile& profile,
                const workspace::VoxelBox& part, workspace::ObjectBricks& bricks,
                const workspace::WorkOptions& options) {
  if (profile.inside_thickness_vox.empty() || solid.box.empty()) return;
  workspace::LayerProfile inwards;
  inwards.thickness_vox = profile.inside_thickness_vox;
  const workspace::ObjectBricks layers = distance_bricks(hollow(solid), inwards, part, options);
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

}  // namespace phantom::layers
