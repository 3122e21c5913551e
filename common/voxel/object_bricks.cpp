#include "common/voxel/object_bricks.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace phantom::voxel {
namespace {

using Orders = std::array<std::int8_t, kBrickVoxels>;

const Orders& all_interior() {
  static const Orders orders = [] {
    Orders filled;
    filled.fill(kOrderInterior);
    return filled;
  }();
  return orders;
}

/// Whether any voxel of the box (in the grid, inside the object's box) is not free.
bool anything_in(const ObjectVoxels& object, const VoxelBox& part) {
  for (std::int32_t z = part.min.z; z < part.min.z + part.size[2]; ++z) {
    for (std::int32_t y = part.min.y; y < part.min.y + part.size[1]; ++y) {
      const std::int8_t* row = object.order.data() + object.index(part.min.x - object.box.min.x,
                                                                  y - object.box.min.y, z - object.box.min.z);
      if (std::any_of(row, row + part.size[0], [](std::int8_t order) { return order != kOrderFree; }))
        return true;
    }
  }
  return false;
}

std::unique_ptr<std::int8_t[]> copy_of(const ObjectVoxels& object, const VoxelBox& part) {
  auto orders = std::make_unique<std::int8_t[]>(kBrickVoxels);
  for (std::int32_t z = part.min.z; z < part.min.z + part.size[2]; ++z) {
    for (std::int32_t y = part.min.y; y < part.min.y + part.size[1]; ++y) {
      const std::int8_t* row = object.order.data() + object.index(part.min.x - object.box.min.x,
                                                                  y - object.box.min.y, z - object.box.min.z);
      for (std::int32_t i = 0; i < part.size[0]; ++i) {
        orders[brick_offset(static_cast<std::uint32_t>((part.min.x + i) & 31),
                            static_cast<std::uint32_t>(y & 31), static_cast<std::uint32_t>(z & 31))] = row[i];
      }
    }
  }
  return orders;
}

}  // namespace

ObjectBricks::ObjectBricks(std::vector<Part> parts) {
  std::sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.key < b.key; });
  keys_.reserve(parts.size());
  orders_.reserve(parts.size());
  for (Part& part : parts) {
    keys_.push_back(part.key);
    orders_.push_back(std::move(part.orders));
  }
}

ObjectBricks ObjectBricks::of(const ObjectVoxels& dense, const GridSpec& grid) {
  const VoxelBox inside = dense.box.intersection(VoxelBox::of(grid));
  if (inside.empty()) return {};
  const auto last_of = [](std::int32_t from, std::int32_t count) { return (from + count - 1) / kBrickEdge; };
  std::vector<Part> parts;
  BrickKey key;
  for (key.z = inside.min.z / kBrickEdge; key.z <= last_of(inside.min.z, inside.size[2]); ++key.z) {
    for (key.y = inside.min.y / kBrickEdge; key.y <= last_of(inside.min.y, inside.size[1]); ++key.y) {
      for (key.x = inside.min.x / kBrickEdge; key.x <= last_of(inside.min.x, inside.size[0]); ++key.x) {
        const VoxelBox part = inside.intersection(box_of(key));
        if (anything_in(dense, part)) parts.push_back({key, copy_of(dense, part)});
      }
    }
  }
  return ObjectBricks(std::move(parts));
}

const std::int8_t* ObjectBricks::orders(BrickKey key) const noexcept {
  const auto found = std::lower_bound(keys_.begin(), keys_.end(), key);
  if (found == keys_.end() || *found != key) return nullptr;
  const auto& own = orders_[static_cast<std::size_t>(found - keys_.begin())];
  return own ? own.get() : all_interior().data();
}

bool ObjectBricks::is_interior(BrickKey key) const noexcept {
  const auto found = std::lower_bound(keys_.begin(), keys_.end(), key);
  return found != keys_.end() && *found == key && !orders_[static_cast<std::size_t>(found - keys_.begin())];
}

std::int8_t* ObjectBricks::edit(BrickKey key) {
  const auto found = std::lower_bound(keys_.begin(), keys_.end(), key);
  if (found == keys_.end() || *found != key) return nullptr;
  auto& own = orders_[static_cast<std::size_t>(found - keys_.begin())];
  if (!own) {
    own = std::make_unique_for_overwrite<std::int8_t[]>(kBrickVoxels);
    std::memcpy(own.get(), all_interior().data(), kBrickVoxels);
  }
  return own.get();
}

std::int8_t ObjectBricks::at(Index3 v) const noexcept {
  const std::int8_t* brick = orders({v.x / kBrickEdge, v.y / kBrickEdge, v.z / kBrickEdge});
  return brick == nullptr ? kOrderFree
                          : brick[brick_offset(static_cast<std::uint32_t>(v.x & 31), static_cast<std::uint32_t>(v.y & 31),
                                               static_cast<std::uint32_t>(v.z & 31))];
}

std::vector<ObjectBricks::Part> ObjectBricks::take_parts() {
  std::vector<Part> parts;
  parts.reserve(keys_.size());
  for (std::size_t i = 0; i < keys_.size(); ++i) parts.push_back({keys_[i], std::move(orders_[i])});
  keys_.clear();
  orders_.clear();
  return parts;
}

std::size_t ObjectBricks::bytes() const noexcept {
  const auto own = std::count_if(orders_.begin(), orders_.end(), [](const auto& orders) { return orders != nullptr; });
  return static_cast<std::size_t>(own) * kBrickVoxels + keys_.capacity() * sizeof(BrickKey) +
         orders_.capacity() * sizeof(orders_[0]);
}

}  // namespace phantom::voxel
