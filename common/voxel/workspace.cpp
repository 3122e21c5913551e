#include "common/voxel/workspace.hpp"

#include <algorithm>
#include <stdexcept>

#include "common/voxel/palette.hpp"
#include "common/voxel/workspace_hash.hpp"

namespace phantom::voxel {
namespace {

std::int32_t bricks_along(std::int32_t voxels) { return (voxels + kBrickEdge - 1) / kBrickEdge; }

}  // namespace

Workspace::Workspace(const GridSpec& grid, std::vector<float> palette_Pa_s_per_m)
    : grid_(grid),
      palette_(std::move(palette_Pa_s_per_m)),
      size_bricks_{bricks_along(grid.size_vox[0]), bricks_along(grid.size_vox[1]),
                   bricks_along(grid.size_vox[2])},
      mu_codes_(kBrickVoxels),
      orders_(kBrickVoxels),
      objects_(kBrickVoxels) {
  if (const core::Status checked = check_palette(palette_); !checked)
    throw std::invalid_argument(checked.message());
  directory_.resize(static_cast<std::size_t>(size_bricks_[0]) * static_cast<std::size_t>(size_bricks_[1]) *
                    static_cast<std::size_t>(size_bricks_[2]));
}

std::vector<BrickKey> Workspace::bricks() const {
  std::vector<BrickKey> keys;
  keys.reserve(brick_count());
  BrickKey key;
  for (key.z = 0; key.z < size_bricks_[2]; ++key.z) {
    for (key.y = 0; key.y < size_bricks_[1]; ++key.y) {
      for (key.x = 0; key.x < size_bricks_[0]; ++key.x) {
        if (has_brick(key)) keys.push_back(key);
      }
    }
  }
  return keys;
}

std::size_t Workspace::bytes() const noexcept {
  return directory_.size() * sizeof(directory_[0]) +
         slots_in_use_ * kBrickVoxels * (sizeof(mu_codes_[0]) + sizeof(orders_[0]) + sizeof(objects_[0]));
}

Workspace::BrickView Workspace::brick(BrickKey key) const noexcept {
  const std::size_t first = directory_[directory_index(key)] * kBrickVoxels;
  return {mu_codes_.data() + first, orders_.data() + first, objects_.data() + first};
}

void Workspace::reserve_bricks(std::size_t count) {
  const std::size_t voxels = (count + 1) * kBrickVoxels;
  mu_codes_.reserve(voxels);
  orders_.reserve(voxels);
  objects_.reserve(voxels);
}

Workspace::MutableBrick Workspace::make_brick(BrickKey key) {
  std::uint32_t& slot = directory_[directory_index(key)];
  if (slot == 0) {
    if (free_slots_.empty()) {
      slot = static_cast<std::uint32_t>(slots_in_use_++);
      mu_codes_.resize(slots_in_use_ * kBrickVoxels);
      orders_.resize(slots_in_use_ * kBrickVoxels);
      objects_.resize(slots_in_use_ * kBrickVoxels);
    } else {
      slot = free_slots_.back();
      free_slots_.pop_back();
    }
  }
  const std::size_t first = slot * kBrickVoxels;
  return {mu_codes_.data() + first, orders_.data() + first, objects_.data() + first};
}

void Workspace::remove_brick(BrickKey key) {
  std::uint32_t& slot = directory_[directory_index(key)];
  if (slot == 0) return;
  const std::size_t first = slot * kBrickVoxels;
  std::fill_n(mu_codes_.data() + first, kBrickVoxels, std::uint8_t{0});
  std::fill_n(orders_.data() + first, kBrickVoxels, std::int8_t{0});
  std::fill_n(objects_.data() + first, kBrickVoxels, std::uint16_t{0});
  free_slots_.push_back(slot);
  slot = 0;
}

std::uint64_t Workspace::content_hash() const {
  std::uint64_t hash = header_hash(grid_, palette_);
  for (const BrickKey key : bricks()) hash += brick_hash(key, brick(key));
  return hash;
}

}  // namespace phantom::voxel
