#pragma once

#include <random>

#include "common/voxelise/voxelise.hpp"

namespace phantom::voxelise {

/// Scattered voxels, one in `one_in`, a third of them interior, a third boundary, a third boundary with its
/// centre inside: no body has such, and every method must cope.
inline SolidVoxels scattered_solid(unsigned seed, std::array<std::int32_t, 3> size, int one_in,
                                   workspace::Index3 min = {20, 25, 30}) {
  std::mt19937 random(seed);
  SolidVoxels solid;
  solid.box = {min, size};
  solid.boundary = solid.inside = workspace::BitVolume(size);
  for (std::int32_t z = 0; z < size[2]; ++z) {
    for (std::int32_t y = 0; y < size[1]; ++y) {
      for (std::int32_t x = 0; x < size[0]; ++x) {
        if (random() % static_cast<unsigned>(one_in) != 0) continue;
        const auto kind = random() % 3;
        if (kind != 0) solid.boundary.set(x, y, z);
        if (kind != 1) solid.inside.set(x, y, z);
      }
    }
  }
  return solid;
}

/// A block with a wall through its middle, as of two bodies that overlap: whole bricks lie inside, but for
/// those of the wall.
inline SolidVoxels walled_block() {
  SolidVoxels solid;
  solid.box = {{5, 3, 2}, {92, 84, 90}};
  solid.boundary = solid.inside = workspace::BitVolume(solid.box.size);
  for (std::int32_t z = 0; z < solid.box.size[2]; ++z) {
    for (std::int32_t y = 0; y < solid.box.size[1]; ++y) {
      for (std::int32_t x = 0; x < solid.box.size[0]; ++x) {
        solid.inside.set(x, y, z);
        if (x == 40 || x == 0 || y == 0 || z == 0 || x == solid.box.size[0] - 1) solid.boundary.set(x, y, z);
      }
    }
  }
  return solid;
}

}  // namespace phantom::voxelise
