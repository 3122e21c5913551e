#pragma once

#include <algorithm>
#include <functional>

#include "common/voxel/object_bricks.hpp"
#include "common/voxel/profile.hpp"
#include "common/voxel/voxelise.hpp"

namespace phantom::voxel {

/// The part of space in which a body must be voxelised so that its layers are right inside the grid.
inline VoxelBox voxelise_clip(const GridSpec& grid, const LayerProfile& profile) {
  return VoxelBox::of(grid).grown(std::max(profile.reach_vox(), profile.inside_depth_vox()));
}

/// How layers are laid, and whom that asks.
struct LayerOptions {
  int threads = 1;
  std::function<bool(double share)> go_on;  ///< asked now and then by the caller's thread, with the share that is done; "no" ends it: no bricks
};

/// Layers by the `distance` method (spec 1.4): with d the Euclidean distance in voxels from a voxel's centre
/// to the nearest solid voxel's centre, j the guard and W_i = m_1 + … + m_i, a voxel is guard for 0 < d ≤ j
/// and has order i for j + W_{i−1} < d ≤ j + W_i. Exact: integers only. `part` is the part of the grid whose
/// bricks are wanted, its corners at whole bricks; the solid must be known within the profile's reach around it.
/// The profile must be checked. Time: linear in the bricks around the solid; memory: those, and a few MiB a
/// thread. The same for any number of threads. Not real-time safe.
ObjectBricks distance_bricks(const SolidVoxels& solid, const LayerProfile& profile, const VoxelBox& part,
                             const LayerOptions& options = {});

}  // namespace phantom::voxel
