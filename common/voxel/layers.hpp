#pragma once

#include <vector>

#include "common/voxel/profile.hpp"
#include "common/voxel/voxel_box.hpp"
#include "common/voxel/voxelise.hpp"

namespace phantom::voxel {

/// Object voxel array (OVA, spec 1.3): one object's neighbour orders in a box of the grid, dense, x fastest,
/// then y, z.
struct ObjectVoxels {
  VoxelBox box;
  std::vector<std::int8_t> order;

  std::size_t index(std::int32_t x, std::int32_t y, std::int32_t z) const {  // from the box's corner
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(box.size[1]) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(box.size[0]) +
           static_cast<std::size_t>(x);
  }
  std::int8_t at(Index3 v) const {  // voxel of the grid; free outside the box
    const std::int32_t x = v.x - box.min.x, y = v.y - box.min.y, z = v.z - box.min.z;
    if (x < 0 || y < 0 || z < 0 || x >= box.size[0] || y >= box.size[1] || z >= box.size[2]) return 0;
    return order[index(x, y, z)];
  }
};

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

}  // namespace phantom::voxel
