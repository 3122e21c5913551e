#include "common/layers/brick_painter.hpp"

#include <algorithm>
#include <cstring>

namespace phantom::layers::detail {
namespace {

/// Gives an order to the voxels of neighbouring tiles: bit 4 t + dx of rows[4 dz + dy] is voxel (dx, dy, dz)
/// of tile t.
void paint_tiles(const TileRows& rows, std::uint64_t any, std::int8_t order, std::int8_t* tiles) {
  constexpr std::uint32_t kEach = 0x01010101;
  const std::uint32_t four = static_cast<std::uint8_t>(order) * kEach;
  for (std::size_t tile = 0; tile < 16 && any >> (4 * tile) != 0; ++tile) {
    if ((any >> (4 * tile) & 15) == 0) continue;
    for (std::size_t row = 0; row < rows.size(); ++row) {
      const auto bits = static_cast<std::uint32_t>(rows[row] >> (4 * tile) & 15);
      const std::uint32_t chosen = (bits * 0x00204081U & kEach) * 255U;  // a byte for each bit
      std::int8_t* const at = tiles + 64 * tile + 4 * row;
      std::uint32_t voxels;
      std::memcpy(&voxels, at, 4);
      voxels = (voxels & ~chosen) | (four & chosen);
      std::memcpy(at, &voxels, 4);
    }
  }
}

}  // namespace

BrickPainter::BrickPainter(const workspace::VoxelBox& part)
    : part_(part), bricks_(part.empty() ? workspace::VoxelBox{} : workspace::bricks_of(part)) {
  slots_.resize(bricks_.voxel_count());
}

void BrickPainter::paint(std::int32_t x, std::int32_t y, std::int32_t z, const TileRows& rows,
                         std::int8_t order) {
  TileRows within = rows;
  std::uint64_t any = 0;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    const auto dy = static_cast<std::int32_t>(row % 4), dz = static_cast<std::int32_t>(row / 4);
    const std::int32_t left = part_.end().x - x;
    if (!part_.contains(workspace::Index3{part_.min.x, y + dy, z + dz})) within[row] = 0;
    if (left < 64) within[row] &= (std::uint64_t{1} << std::max(0, left)) - 1;
    any |= within[row];
  }
  for (const std::int32_t half : {0, workspace::kBrickEdge}) {
    const std::uint64_t any_of_half = any >> half & 0xffffffff;
    if (any_of_half == 0 || x + half < part_.min.x) continue;
    auto& orders = slots_[bricks_.index(workspace::brick_of({x + half, y, z}))].orders;
    if (!orders) orders = std::make_unique<std::int8_t[]>(workspace::kBrickVoxels);
    if (half > 0) {
      for (std::uint64_t& row : within) row >>= half;
    }
    paint_tiles(within, any_of_half, order,
                orders.get() + workspace::brick_offset(workspace::Index3{0, y, z}));
  }
}

bool BrickPainter::fill_interior(workspace::BrickKey key) {
  if (!part_.contains(workspace::box_of(key))) return false;
  slots_[bricks_.index(key)].interior = true;
  return true;
}

workspace::ObjectBricks BrickPainter::finish() {
  std::vector<workspace::ObjectBricks::Part> parts;
  bricks_.for_each([&](workspace::Index3 key) {
    Slot& slot = slots_[bricks_.index(key)];
    if (slot.orders || slot.interior) parts.push_back({{key}, std::move(slot.orders)});
  });
  slots_.clear();
  return workspace::ObjectBricks(std::move(parts));
}

}  // namespace phantom::layers::detail
