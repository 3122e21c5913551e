#pragma once

#include <vector>

#include "common/workspace/voxel_box.hpp"

namespace phantom::layers {

/// Object voxel array (OVA, spec 1.3): one object's neighbour orders in a box of the grid, dense, x fastest,
/// then y, z.
struct ObjectVoxels {
  workspace::VoxelBox box;
  std::vector<std::int8_t> order;

  std::size_t index(std::int32_t x, std::int32_t y, std::int32_t z) const {  // from the box's corner
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(box.size[1]) +
            static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(box.size[0]) +
           static_cast<std::size_t>(x);
  }
  std::int8_t at(workspace::Index3 v) const {  // voxel of the grid; free outside the box
    const std::int32_t x = v.x - box.min.x, y = v.y - box.min.y, z = v.z - box.min.z;
    if (x < 0 || y < 0 || z < 0 || x >= box.size[0] || y >= box.size[1] || z >= box.size[2]) return 0;
    return order[index(x, y, z)];
  }
};

}  // namespace phantom::layers
