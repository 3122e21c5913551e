#include "common/voxel/layers.hpp"

#include <algorithm>
#include <cstring>

#include "common/voxel/banded_distance.hpp"
#include "common/voxel/workspace.hpp"

namespace phantom::voxel {
namespace {

/// Order by squared distance, 0…(reach + 1)²; the last entry stands for "farther".
std::vector<std::int8_t> orders_by_square(const LayerProfile& profile) {
  const int reach = profile.reach_vox();
  std::vector<std::int8_t> orders(static_cast<std::size_t>((reach + 1) * (reach + 1) + 1), kOrderFree);
  const auto fill = [&](int after, int until, std::int8_t order) {  // after < d ≤ until
    for (int square = after * after + 1; square <= until * until; ++square)
      orders[static_cast<std::size_t>(square)] = order;
  };
  orders[0] = kOrderInterior;
  fill(0, profile.guard_vox, kOrderGuard);
  int from = profile.guard_vox;
  for (std::size_t i = 0; i < profile.thickness_vox.size(); ++i) {
    fill(from, from + profile.thickness_vox[i], static_cast<std::int8_t>(i + 1));
    from += profile.thickness_vox[i];
  }
  return orders;
}

/// Calls put(x, y, z) in `box` coordinates for every set bit of a volume that covers `from`.
template <class Put>
void for_each_bit(const BitVolume& bits, const VoxelBox& from, const VoxelBox& box, Put put) {
  const std::int32_t dx = from.min.x - box.min.x, dy = from.min.y - box.min.y, dz = from.min.z - box.min.z;
  for (std::int32_t z = 0; z < from.size[2]; ++z) {
    for (std::int32_t y = 0; y < from.size[1]; ++y) {
      const std::uint64_t* row = bits.row(y, z);
      for (std::size_t i = 0; i < bits.words_per_row(); ++i) {
        for (std::uint64_t w = row[i]; w != 0; w &= w - 1) {
          put(static_cast<std::int32_t>(i * 64) + std::countr_zero(w) + dx, y + dy, z + dz);
        }
      }
    }
  }
}

}  // namespace

ObjectVoxels distance_layers(const SolidVoxels& solid, const LayerProfile& profile, const VoxelBox& clip) {
  ObjectVoxels ova;
  if (solid.box.empty()) return ova;
  ova.box = solid.box.grown(profile.reach_vox()).intersection(clip);
  if (ova.box.empty()) return ova;
  const auto reach = static_cast<std::uint8_t>(profile.reach_vox());
  ova.order.resize(ova.box.voxel_count());
  // The same bytes hold, one after the other: distance along z, then the order.
  auto* bytes = reinterpret_cast<std::uint8_t*>(ova.order.data());
  std::memset(bytes, reach + 1, ova.order.size());
  const auto mark = [&](std::int32_t x, std::int32_t y, std::int32_t z) { bytes[ova.index(x, y, z)] = 0; };
  for_each_bit(solid.interior, solid.box, ova.box, mark);
  for_each_bit(solid.boundary, solid.box, ova.box, mark);
  detail::distance_along_z(bytes, ova.box.size, reach);
  detail::orders_of_slices(bytes, ova.box.size, reach, orders_by_square(profile));
  for_each_bit(solid.boundary, solid.box, ova.box, [&](std::int32_t x, std::int32_t y, std::int32_t z) {
    ova.order[ova.index(x, y, z)] = kOrderBoundary;
  });
  return ova;
}

ObjectBricks distance_bricks(const SolidVoxels& solid, const LayerProfile& profile, const GridSpec& grid,
                             const LayerOptions& /*options*/) {
  return ObjectBricks::of(distance_layers(solid, profile, voxelise_clip(grid, profile)), grid);
}

}  // namespace phantom::voxel
