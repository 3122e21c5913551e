#pragma once

#include <algorithm>

#include "common/voxelise/voxelise.hpp"
#include "common/workspace/object_bricks.hpp"
#include "common/workspace/profile.hpp"
#include "common/workspace/work_options.hpp"

namespace phantom::layers {

/// Returns the part of space in which a body must be voxelised so that its layers are right inside the grid.
inline workspace::VoxelBox voxelise_clip(const workspace::GridSpec& grid,
                                         const workspace::LayerProfile& profile) {
  return workspace::VoxelBox::of(grid).grown(std::max(profile.reach_vox(), profile.inside_depth_vox()));
}

/// Lays layers by the `distance` method (spec 1.4). Let d be the Euclidean distance in voxels from a voxel's
/// centre to the nearest solid voxel's centre, j the guard and W_i = m_1 + … + m_i. Then a voxel is guard for
/// 0 < d ≤ j and has order i for j + W_{i−1} < d ≤ j + W_i. Exact: integers only. Computes the bricks of
/// `part`, a part of the grid with corners at whole bricks. The solid must be known within the profile's
/// reach around it. The profile must have been checked. Time: linear in the bricks around the solid. Memory:
/// those bricks, and a few MiB for each thread. The same for any number of threads. Not real-time safe.
workspace::ObjectBricks distance_bricks(const voxelise::SolidVoxels& solid,
                                        const workspace::LayerProfile& profile,
                                        const workspace::VoxelBox& part,
                                        const workspace::WorkOptions& options = {});

}  // namespace phantom::layers
