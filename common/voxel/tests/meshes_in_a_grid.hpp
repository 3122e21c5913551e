#pragma once

#include <gtest/gtest.h>

#include "common/voxel/tests/literal_twins.hpp"
#include "common/voxel/voxelise.hpp"

namespace phantom::voxel {

// The grid in which the tests of voxelise() put their meshes.

inline const GridSpec kGrid{{-0.4, -0.4, -0.4}, 0.01, {80, 80, 80}};
inline const VoxelBox kAll = VoxelBox::of(kGrid);

inline SolidVoxels solid_of(const geometry::TriangleMesh& mesh, int threads = 1,
                            const VoxelBox& clip = kAll) {
  auto solid = voxelise(mesh, kGrid, clip, {threads, nullptr});
  EXPECT_TRUE(solid) << solid.status().message();
  return std::move(*solid);
}

/// Voxels of the grid on whose inside two solids differ.
inline std::size_t differing(const SolidVoxels& a, const SolidVoxels& b) {
  std::size_t count = 0;
  twin::for_each(kAll, [&](Index3 v) { count += twin::is_inside(a, v) != twin::is_inside(b, v) ? 1 : 0; });
  return count;
}

}  // namespace phantom::voxel
