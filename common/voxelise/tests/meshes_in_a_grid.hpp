#pragma once

#include <gtest/gtest.h>

#include "common/voxelise/tests/literal_twins.hpp"
#include "common/voxelise/voxelise.hpp"

namespace phantom::voxelise {

// The grid in which the tests of voxelise() put their meshes.

inline const workspace::GridSpec kGrid{{-0.4, -0.4, -0.4}, 0.01, {80, 80, 80}};
inline const workspace::VoxelBox kAll = workspace::VoxelBox::of(kGrid);

inline SolidVoxels solid_of(const geometry::TriangleMesh& mesh, int threads = 1,
                            const workspace::VoxelBox& clip = kAll, const workspace::GridSpec& grid = kGrid) {
  auto solid = voxelise(mesh, grid, clip, {threads, nullptr});
  EXPECT_TRUE(solid) << solid.status().message();
  return std::move(*solid);
}

/// Voxels of the grid on whose inside two solids differ.
inline std::size_t differing(const SolidVoxels& a, const SolidVoxels& b) {
  std::size_t count = 0;
  twin::for_each(
      kAll, [&](workspace::Index3 v) { count += twin::is_inside(a, v) != twin::is_inside(b, v) ? 1 : 0; });
  return count;
}

}  // namespace phantom::voxelise
