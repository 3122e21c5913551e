#pragma once

// Private to this library: builds an object's bricks from bits, 64 voxels at a time.

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "common/workspace/object_bricks.hpp"

namespace phantom::layers::detail {

using TileRows = std::array<std::uint64_t, 16>;

/// Collects an object's orders, given as words of bits along x, in the bricks of a part of a grid. Voxels
/// outside the part are ignored. Threads may paint at the same time if they paint in different layers of
/// bricks along z.
class BrickPainter {
 public:
  /// The corner of `part` must be a brick's corner.
  explicit BrickPainter(const workspace::VoxelBox& part);

  /// Gives an order to the voxels (x + bit, y, z) of 4 × 4 rows whose bits are set, with rows[4 dz + dy]. `x`
  /// must be a multiple of 64, y and z of 4.
  void paint(std::int32_t x, std::int32_t y, std::int32_t z, const TileRows& rows, std::int8_t order);
  /// Marks a whole brick as interior; nothing else may be painted in it. Does nothing and returns false if
  /// the brick does not lie wholly within the part.
  bool fill_interior(workspace::BrickKey key);
  /// Returns the painted bricks and leaves the painter empty.
  workspace::ObjectBricks finish();

 private:
  struct Slot {
    std::unique_ptr<std::int8_t[]> orders;
    bool interior = false;
  };
  workspace::VoxelBox part_, bricks_;
  std::vector<Slot> slots_;  // by bricks_.index()
};

}  // namespace phantom::layers::detail
