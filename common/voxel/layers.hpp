#pragma once

#include <functional>

#include "common/voxel/object_bricks.hpp"
#include "common/voxel/profile.hpp"
#include "common/voxel/voxelise.hpp"

namespace phantom::voxel {

/// The part of space in which a body must be voxelised so that its layers are right inside the grid.
inline VoxelBox voxelise_clip(const GridSpec& grid, const LayerProfile& profile) {
  return VoxelBox::of(grid).grown(profile.reach_vox());
}

/// Layers by the `distance` method (spec 1.4): with d the Euclidean distance in voxels from a voxel's centre
/// to the nearest solid voxel's centre, j the guard and W_i = m_1 + … + m_i, a voxel is guard for 0 < d ≤ j
/// and has order i for j + W_{i−1} < d ≤ j + W_i. Exact: integers only. The result covers the solid's box
/// grown by the profile's reach, within `clip` (pass VoxelBox::of(grid).grown(reach): what lies beyond cannot
/// reach the grid). The profile must be checked. One byte a voxel of that box, plus one slice. Not real-time
/// safe.
ObjectVoxels distance_layers(const SolidVoxels& solid, const LayerProfile& profile, const VoxelBox& clip);

/// How layers are laid, and whom that asks.
struct LayerOptions {
  int threads = 1;
  std::function<bool(double share)> go_on;  ///< asked now and then with the share done; "no" ends it: no bricks then
};

/// The same layers as bricks of the workspace's grid, only those that hold something.
ObjectBricks distance_bricks(const SolidVoxels& solid, const LayerProfile& profile, const GridSpec& grid,
                             const LayerOptions& options = {});

}  // namespace phantom::voxel
