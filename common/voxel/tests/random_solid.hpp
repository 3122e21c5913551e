#pragma once

#include <random>

#include "common/voxel/voxelise.hpp"

namespace phantom::voxel {

/// Scattered voxels, one in `one_in`, half of them boundary, half interior: no body has such, and every
/// method must cope.
inline SolidVoxels scattered_solid(unsigned seed, std::array<std::int32_t, 3> size, int one_in,
                                   Index3 min = {20, 25, 30}) {
  std::mt19937 random(seed);
  SolidVoxels solid;
  solid.box = {min, size};
  solid.boundary = solid.interior = BitVolume(size);
  for (std::int32_t z = 0; z < size[2]; ++z) {
    for (std::int32_t y = 0; y < size[1]; ++y) {
      for (std::int32_t x = 0; x < size[0]; ++x) {
        if (random() % static_cast<unsigned>(one_in) != 0) continue;
        (random() % 2 == 0 ? solid.boundary : solid.interior).set(x, y, z);
      }
    }
  }
  solid.inside = solid.interior;
  return solid;
}

}  // namespace phantom::voxel
