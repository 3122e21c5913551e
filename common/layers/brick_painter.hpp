#pragma once

// Private to this library: an object's bricks made from bits, 64 voxels at a time.

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/workspace/object_bricks.hpp"

namespace phantom::layers::detail {

using TileRows = std::array<std::uint64_t, 16>;

/// Collects the orders of an object, given as words of bits along x, as bricks of a part of a grid. What lies
/// outside of the part is left out. Threads may paint at the same time as long as they paint in different
/// layers of bricks along z.
class BrickPainter {
 public:
  /// `part`: its corner is a brick's.
  explicit BrickPainter(const workspace::VoxelBox& part);

  /// Gives the voxels (x + bit, y, z) of 4 × 4 rows an order: rows[4 dz + dy]. `x` is a multiple of 64, y and
  /// z of 4.
  void paint(std::int32_t x, std::int32_t y, std::int32_t z, const TileRows& rows, std::int8_t order);
  /// The whole brick is interior, and nothing is painted in it. False, and nothing done, if it does not lie
  /// within the part as a whole.
  bool fill_interior(workspace::BrickKey key);
  /// What was painted; the painter is empty then.
  workspace::ObjectBricks finish();

 private:
  struct Slot {
    std::unique_ptr<std::int8_t[]> orders;
    bool interior = false;
  };
  Slot& slot(workspace::BrickKey key) {
    return slots_[(static_cast<std::size_t>(key.z - first_.z) * bricks_[1] +
                   static_cast<std::size_t>(key.y - first_.y)) *
                      bricks_[0] +
                  static_cast<std::size_t>(key.x - first_.x)];
  }
  std::array<std::int32_t, 3> from_, to_;  // the part
  workspace::BrickKey first_;
  std::array<std::size_t, 3> bricks_;
  std::vector<Slot> slots_;
};

}  // namespace phantom::layers::detail
