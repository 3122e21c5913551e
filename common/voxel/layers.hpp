#pragma once

#include <algorithm>

#include "common/voxel/object_bricks.hpp"
#include "common/voxel/profile.hpp"
#include "common/voxel/voxelise.hpp"
#include "common/voxel/work_options.hpp"

namespace phantom::voxel {

/// The part of space in which a body must be voxelised so that its layers are right inside the grid.
inline VoxelBox voxelise_clip(const GridSpec& grid, const LayerProfile& profile) {
  return VoxelBox::of(grid).grown(std::max(profile.reach_vox(), profile.inside_depth_vox()));
}

/// Layers by the `distance` method (spec 1.4): with d the Euclidean distance in voxels from a voxel's centre
/// to the nearest solid voxel's centre, j the guard and W_i = m_1 + … + m_i, a voxel is guard for 0 < d ≤ j
/// and has order i for j + W_{i−1} < d ≤ j + W_i. Exact: integers only. `part` is the part of the grid whose
/// bricks are wanted, its corners at whole bricks; the solid must be known within the profile's reach around
/// it. The profile must be checked. Time: linear in the bricks around the solid; memory: those, and a few MiB
/// a thread. The same for any number of threads. Not real-time safe.
ObjectBricks distance_bricks(const SolidVoxels& solid, const LayerProfile& profile, const VoxelBox& part,
                             const WorkOptions& options = {});

}  // namespace phantom::voxel
