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
      mu_codes_(kBrickVoxels, 0),
      slots_(1) {
  slots_[0].own_orders.assign(kBrickVoxels, 0);
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
  std::size_t orders = 0;
  for (const Slot& slot : slots_) {
    orders += slot.own_orders.size() + (slot.shared_orders ? kBrickVoxels : 0) + slot.orders_by_code.bytes();
  }
  return directory_.size() * sizeof(directory_[0]) + slots_.size() * sizeof(slots_[0]) + mu_codes_.size() +
         orders + objects_.size() * sizeof(objects_[0]);
}

void Workspace::BrickView::copy_orders(std::int8_t* to) const {
  if (order != nullptr) {
    std::copy_n(order, kBrickVoxels, to);
  } else {
    orders_by_code(*tables, second, mu_code, to);
  }
}

void Workspace::BrickView::copy_objects(std::uint16_t* to) const {
  if (object != nullptr) {
    std::copy_n(object, kBrickVoxels, to);
  } else {
    for (std::size_t i = 0; i < kBrickVoxels; ++i) to[i] = mu_code[i] != 0 ? sole_object : std::uint16_t{0};
  }
}

void Workspace::reserve_bricks(std::size_t count) {
  mu_codes_.reserve((count + 1) * kBrickVoxels);
  slots_.reserve(count + 1);
}

void Workspace::reserve_for(std::size_t more_bricks, std::size_t of_several) {
  if (more_bricks > free_slots_.size()) reserve_bricks(slots_.size() - 1 + more_bricks - free_slots_.size());
  if (of_several <= free_object_lists_.size()) return;
  const std::size_t lists =
      std::max(kBrickVoxels, objects_.size()) / kBrickVoxels + of_several - free_object_lists_.size();
  if (lists * kBrickVoxels > objects_.capacity()) objects_.reserve(lists * kBrickVoxels);
}

std::uint32_t Workspace::take_slot() {
  std::uint32_t slot;
  if (free_slots_.empty()) {
    slot = static_cast<std::uint32_t>(slots_.size());
    slots_.emplace_back();
    mu_codes_.resize(slots_.size() * kBrickVoxels);
  } else {
    slot = free_slots_.back();
    free_slots_.pop_back();
  }
  Slot& about = slots_[slot];
  about.users = 1;
  about.object_list = about.object = 0;
  about.uniform = false;
  return slot;
}

std::uint32_t Workspace::take_object_list() {
  if (!free_object_lists_.empty()) {
    const std::uint32_t list = free_object_lists_.back();
    free_object_lists_.pop_back();
    return list;
  }
  const std::size_t lists = std::max<std::size_t>(1, objects_.size() / kBrickVoxels);
  objects_.resize((lists + 1) * kBrickVoxels);
  return static_cast<std::uint32_t>(lists);
}

Workspace::MutableBrick Workspace::arrays(std::uint32_t slot) noexcept {
  const std::size_t first = slot * kBrickVoxels;
  Slot& about = slots_[slot];
  const std::uint32_t list = about.object_list;
  const bool own = !about.shared_orders && !about.orders_by_code.tables;
  return {mu_codes_.data() + first, own ? about.own_orders.data() : nullptr,
          list == 0 ? nullptr : objects_.data() + list * kBrickVoxels};
}

Workspace::MutableBrick Workspace::edit_brick(BrickKey key) noexcept {
  return arrays(directory_[directory_index(key)]);
}

Workspace::MutableBrick Workspace::make_brick(BrickKey key) {
  const std::size_t place = directory_index(key);
  const std::uint32_t before = directory_[place];
  if (slots_[before].object_list != 0) return arrays(before);
  std::uint32_t slot = before;
  if (before == 0 || slots_[before].uniform) {
    slot = take_slot();
    std::copy_n(mu_codes_.data() + before * kBrickVoxels, kBrickVoxels,
                mu_codes_.data() + slot * kBrickVoxels);
    slots_[slot].own_orders.resize(kBrickVoxels);
    view(before).copy_orders(slots_[slot].own_orders.data());
  } else if (arrays(slot).order == nullptr) {
    LargeVector<std::int8_t> orders(kBrickVoxels);
    view(slot).copy_orders(orders.data());
    slots_[slot].own_orders = std::move(orders);
    slots_[slot].shared_orders = nullptr;
    slots_[slot].orders_by_code = {};
  }
  const std::uint32_t list = take_object_list();
  brick(key).copy_objects(objects_.data() + list * kBrickVoxels);
  if (slot != before) {
    remove_brick(key);
    directory_[place] = slot;
    ++brick_count_;
  }
  slots_[slot].object_list = list;
  return arrays(slot);
}

/// Memory of the brick's own, anew.
std::uint32_t Workspace::make_slot(BrickKey key, std::uint16_t object) {
  remove_brick(key);
  const std::uint32_t slot = take_slot();
  slots_[slot].object = object;
  directory_[directory_index(key)] = slot;
  ++brick_count_;
  return slot;
}

Workspace::MutableBrick Workspace::make_brick_of(BrickKey key, std::uint16_t object,
                                                 std::shared_ptr<const std::int8_t[]> orders) {
  const std::uint32_t slot = make_slot(key, object);
  if (orders) {
    slots_[slot].own_orders = {};
    slots_[slot].shared_orders = std::move(orders);
  } else {
    slots_[slot].own_orders.resize(kBrickVoxels);
  }
  return arrays(slot);
}

Workspace::MutableBrick Workspace::make_brick_of(BrickKey key, std::uint16_t object, OrdersByCode orders) {
  if (!orders.tables) return make_brick_of(key, object);
  const std::uint32_t slot = make_slot(key, object);
  slots_[slot].own_orders = {};
  slots_[slot].orders_by_code = std::move(orders);
  return arrays(slot);
}

Workspace::MutableBrick Workspace::make_brick_of_several(BrickKey key, OrdersByCode orders) {
  make_brick_of(key, 0, std::move(orders));
  const std::uint32_t slot = directory_[directory_index(key)];
  slots_[slot].object_list = take_object_list();
  return arrays(slot);
}

void Workspace::fill_brick(BrickKey key, std::uint8_t mu_code, std::int8_t order, std::uint16_t object) {
  remove_brick(key);
  const auto alike = std::find_if(uniform_slots_.begin(), uniform_slots_.end(), [&](std::uint32_t slot) {
    const std::size_t first = slot * kBrickVoxels;
    return slots_[slot].object == object && mu_codes_[first] == mu_code && slots_[slot].orders()[0] == order;
  });
  std::uint32_t slot;
  if (alike != uniform_slots_.end()) {
    slot = *alike;
    ++slots_[slot].users;
  } else {
    slot = take_slot();
    slots_[slot].object = object;
    slots_[slot].uniform = true;
    std::fill_n(mu_codes_.data() + slot * kBrickVoxels, kBrickVoxels, mu_code);
    slots_[slot].own_orders.assign(kBrickVoxels, order);
    uniform_slots_.push_back(slot);
  }
  directory_[directory_index(key)] = slot;
  ++brick_count_;
}

void Workspace::remove_brick(BrickKey key) {
  std::uint32_t& place = directory_[directory_index(key)];
  if (place == 0) return;
  Slot& slot = slots_[place];
  if (--slot.users == 0) {
    if (slot.object_list != 0) free_object_lists_.push_back(slot.object_list);
    if (slot.uniform) std::erase(uniform_slots_, place);
    slot.shared_orders = nullptr;
    slot.orders_by_code = {};
    free_slots_.push_back(place);
  }
  place = 0;
  --brick_count_;
}

std::uint64_t Workspace::content_hash() const {
  std::uint64_t hash = header_hash(grid_, palette_);
  for (const BrickKey key : bricks()) hash += brick_hash(key, brick(key));
  return hash;
}

}  // namespace phantom::voxel
