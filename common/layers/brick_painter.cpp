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
    : from_{part.min.x, part.min.y, part.min.z},
      to_{part.min.x + part.size[0], part.min.y + part.size[1], part.min.z + part.size[2]},
      first_{part.min.x >> 5, part.min.y >> 5, part.min.z >> 5},
      bricks_{} {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    bricks_[axis] =
        static_cast<std::size_t>((part.size[axis] + workspace::kBrickEdge - 1) / workspace::kBrickEdge);
  }
  slots_.resize(bricks_[0] * bricks_[1] * bricks_[2]);
}

void BrickPainter::paint(std::int32_t x, std::int32_t y, std::int32_t z, const TileRows& rows,
                         std::int8_t order) {
  TileRows within = rows;
  std::uint64_t any = 0;
  for (std::size_t row = 0; row < rows.size(); ++row) {
    const std::int32_t to_y = y + static_cast<std::int32_t>(row % 4),
                       to_z = z + static_cast<std::int32_t>(row / 4);
    if (to_y < from_[1] || to_y >= to_[1] || to_z < from_[2] || to_z >= to_[2]) within[row] = 0;
    if (to_[0] - x < 64) within[row] &= (std::uint64_t{1} << std::max(0, to_[0] - x)) - 1;
    any |= within[row];
  }
  for (const std::int32_t half : {0, workspace::kBrickEdge}) {
    const std::uint64_t any_of_half = any >> half & 0xffffffff;
    if (any_of_half == 0 || x + half < from_[0]) continue;
    auto& orders = slot({(x + half) >> 5, y >> 5, z >> 5}).orders;
    if (!orders) orders = std::make_unique<std::int8_t[]>(workspace::kBrickVoxels);
    if (half > 0) {
      for (std::uint64_t& row : within) row >>= half;
    }
    paint_tiles(within, any_of_half, order,
                orders.get() + workspace::brick_offset(0, static_cast<std::uint32_t>(y & 31),
                                                       static_cast<std::uint32_t>(z & 31)));
  }
}

bool BrickPainter::fill_interior(workspace::BrickKey key) {
  const workspace::VoxelBox brick = workspace::box_of(key);
  const std::int32_t min[3] = {brick.min.x, brick.min.y, brick.min.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (min[axis] < from_[axis] || min[axis] + workspace::kBrickEdge > to_[axis]) return false;
  }
  slot(key).interior = true;
  return true;
}

workspace::ObjectBricks BrickPainter::finish() {
  std::vector<workspace::ObjectBricks::Part> parts;
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    if (!slots_[i].orders && !slots_[i].interior) continue;
    const workspace::BrickKey key{first_.x + static_cast<std::int32_t>(i % bricks_[0]),
                                  first_.y + static_cast<std::int32_t>(i / bricks_[0] % bricks_[1]),
                                  first_.z + static_cast<std::int32_t>(i / (bricks_[0] * bricks_[1]))};
    parts.push_back({key, std::move(slots_[i].orders)});
  }
  slots_.clear();
  return workspace::ObjectBricks(std::move(parts));
}

}  // namespace phantom::layers::detail
