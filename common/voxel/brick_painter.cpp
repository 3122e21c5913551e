#include "common/voxel/brick_painter.hpp"

namespace phantom::voxel::detail {

BrickPainter::BrickPainter(const VoxelBox& part)
    : from_{part.min.x, part.min.y, part.min.z},
      to_{part.min.x + part.size[0], part.min.y + part.size[1], part.min.z + part.size[2]},
      first_{part.min.x >> 5, part.min.y >> 5, part.min.z >> 5},
      bricks_{} {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    bricks_[axis] = static_cast<std::size_t>((part.size[axis] + kBrickEdge - 1) / kBrickEdge);
  }
  slots_.resize(bricks_[0] * bricks_[1] * bricks_[2]);
}

bool BrickPainter::fill_interior(BrickKey key) {
  const VoxelBox brick = box_of(key);
  const std::int32_t min[3] = {brick.min.x, brick.min.y, brick.min.z};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    if (min[axis] < from_[axis] || min[axis] + kBrickEdge > to_[axis]) return false;
  }
  slot(key).interior = true;
  return true;
}

ObjectBricks BrickPainter::finish() {
  std::vector<ObjectBricks::Part> parts;
  for (std::size_t i = 0; i < slots_.size(); ++i) {
    if (!slots_[i].orders && !slots_[i].interior) continue;
    const BrickKey key{first_.x + static_cast<std::int32_t>(i % bricks_[0]),
                       first_.y + static_cast<std::int32_t>(i / bricks_[0] % bricks_[1]),
                       first_.z + static_cast<std::int32_t>(i / (bricks_[0] * bricks_[1]))};
    parts.push_back({key, std::move(slots_[i].orders)});
  }
  slots_.clear();
  return ObjectBricks(std::move(parts));
}

}  // namespace phantom::voxel::detail
