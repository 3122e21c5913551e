#include "common/voxel/merge.hpp"

#include <algorithm>

namespace phantom::voxel {
namespace {

/// Whether any voxel of the box (in the grid, inside the object's box) is not free.
bool anything_in(const ObjectVoxels& object, const VoxelBox& part) {
  for (std::int32_t z = part.min.z; z < part.min.z + part.size[2]; ++z) {
    for (std::int32_t y = part.min.y; y < part.min.y + part.size[1]; ++y) {
      const std::int8_t* row = object.order.data() + object.index(part.min.x - object.box.min.x,
                                                                  y - object.box.min.y, z - object.box.min.z);
      unsigned any = 0;
      for (std::int32_t x = 0; x < part.size[0]; ++x) any |= static_cast<unsigned char>(row[x]);
      if (any != 0) return true;
    }
  }
  return false;
}

struct Incoming {
  std::uint8_t code;
  std::uint16_t object;
  std::int8_t order;
};

void put_if_prevailing(const Incoming& in, const Workspace::MutableBrick& brick, std::size_t at) {
  const std::uint8_t code = brick.mu_code[at];
  if (in.code < code) return;
  if (in.code == code) {
    if (brick.object[at] != 0 && in.object > brick.object[at]) return;
    if (in.object == brick.object[at] && in.order <= brick.order[at]) return;
  }
  brick.mu_code[at] = in.code;
  brick.object[at] = in.object;
  brick.order[at] = in.order;
}

void merge_part(const ObjectVoxels& object, std::uint16_t object_id, const CodeTable& codes,
                const VoxelBox& part, const Workspace::MutableBrick& brick) {
  for (std::int32_t z = part.min.z; z < part.min.z + part.size[2]; ++z) {
    for (std::int32_t y = part.min.y; y < part.min.y + part.size[1]; ++y) {
      const std::int8_t* row = object.order.data() + object.index(part.min.x - object.box.min.x,
                                                                  y - object.box.min.y, z - object.box.min.z);
      for (std::int32_t i = 0; i < part.size[0]; ++i) {
        if (row[i] == kOrderFree) continue;
        const Incoming in{codes[static_cast<std::uint8_t>(row[i])], object_id, row[i]};
        put_if_prevailing(
            in, brick,
            brick_offset(static_cast<std::uint32_t>((part.min.x + i) & 31),
                         static_cast<std::uint32_t>(y & 31), static_cast<std::uint32_t>(z & 31)));
      }
    }
  }
}

}  // namespace

void merge(const ObjectVoxels& object, std::uint16_t object_id, const CodeTable& codes,
           Workspace& workspace) {
  const VoxelBox inside = object.box.intersection(VoxelBox::of(workspace.grid()));
  if (inside.empty()) return;
  const auto last_of = [](std::int32_t from, std::int32_t count) { return (from + count - 1) / kBrickEdge; };
  BrickKey key;
  for (key.z = inside.min.z / kBrickEdge; key.z <= last_of(inside.min.z, inside.size[2]); ++key.z) {
    for (key.y = inside.min.y / kBrickEdge; key.y <= last_of(inside.min.y, inside.size[1]); ++key.y) {
      for (key.x = inside.min.x / kBrickEdge; key.x <= last_of(inside.min.x, inside.size[0]); ++key.x) {
        const VoxelBox whole{{key.x * kBrickEdge, key.y * kBrickEdge, key.z * kBrickEdge},
                             {kBrickEdge, kBrickEdge, kBrickEdge}};
        const VoxelBox part = inside.intersection(whole);
        if (anything_in(object, part)) merge_part(object, object_id, codes, part, workspace.make_brick(key));
      }
    }
  }
}

}  // namespace phantom::voxel
