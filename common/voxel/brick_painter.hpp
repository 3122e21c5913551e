#pragma once

// Private to this library: an object's bricks made from bits, 64 voxels at a time.

#include <bit>
#include <cstring>
#include <memory>
#include <vector>

#include "common/voxel/object_bricks.hpp"

namespace phantom::voxel::detail {

/// Collects the orders of an object, given as words of bits along x, as bricks of a part of a grid. What lies
/// outside of the part is left out. Threads may paint at the same time as long as they paint in different
/// layers of bricks along z.
class BrickPainter {
 public:
  /// `part`: its corner is a brick's.
  explicit BrickPainter(const VoxelBox& part);

  /// Gives the voxels (x + bit, y, z) an order; each voxel at most once. `x` is a multiple of 64.
  void paint(std::int32_t x, std::int32_t y, std::int32_t z, std::uint64_t bits, std::int8_t order) {
    if (bits == 0 || !between(y, 1) || !between(z, 2)) return;
    paint_half(x, y, z, static_cast<std::uint32_t>(bits), order);
    paint_half(x + kBrickEdge, y, z, static_cast<std::uint32_t>(bits >> 32), order);
  }
  /// The whole brick is interior, and nothing is painted in it. False, and nothing done, if it does not lie
  /// within the part as a whole.
  bool fill_interior(BrickKey key);
  /// What was painted; the painter is empty then.
  ObjectBricks finish();

 private:
  struct Slot {
    std::unique_ptr<std::int8_t[]> orders;
    bool interior = false;
  };
  bool between(std::int32_t voxel, std::size_t axis) const {
    return voxel >= from_[axis] && voxel < to_[axis];
  }
  Slot& slot(BrickKey key) {
    return slots_[(static_cast<std::size_t>(key.z - first_.z) * bricks_[1] +
                   static_cast<std::size_t>(key.y - first_.y)) *
                      bricks_[0] +
                  static_cast<std::size_t>(key.x - first_.x)];
  }
  void paint_half(std::int32_t x, std::int32_t y, std::int32_t z, std::uint32_t bits, std::int8_t order) {
    if (bits == 0 || !between(x, 0)) return;
    if (to_[0] - x < kBrickEdge) bits &= (std::uint32_t{1} << (to_[0] - x)) - 1;
    if (bits == 0) return;
    auto& orders = slot({x >> 5, y >> 5, z >> 5}).orders;
    if (!orders) orders = std::make_unique<std::int8_t[]>(kBrickVoxels);
    std::int8_t* row = orders.get() + brick_offset(0, static_cast<std::uint32_t>(y & 31),
                                                   static_cast<std::uint32_t>(z & 31));
    do {
      const int group = std::countr_zero(bits) / 4;  // four voxels of a tile's row lie side by side
      set_four(row + 64 * group, bits >> (4 * group) & 15, order);
      bits &= ~(std::uint32_t{15} << (4 * group));
    } while (bits != 0);
  }
  static void set_four(std::int8_t* voxels, std::uint32_t bits, std::int8_t order) {
    // Bit i to byte i: copies of the bits seven apart bring each to a byte's lowest place.
    const std::uint32_t ones = bits * 0x00204081U & 0x01010101U;
    std::uint32_t four;
    std::memcpy(&four, voxels, sizeof four);
    four |= ones * static_cast<std::uint8_t>(order);
    std::memcpy(voxels, &four, sizeof four);
  }

  std::array<std::int32_t, 3> from_, to_;  // the part
  BrickKey first_;
  std::array<std::size_t, 3> bricks_;
  std::vector<Slot> slots_;
};

}  // namespace phantom::voxel::detail
