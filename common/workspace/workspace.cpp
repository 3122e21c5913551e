#include "common/workspace/workspace.hpp"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "common/workspace/profile.hpp"
#include "common/workspace/workspace_hash.hpp"

namespace phantom::workspace {
namespace {

std::int32_t bricks_along(std::int32_t voxels) { return (voxels + kBrickEdge - 1) / kBrickEdge; }

std::shared_ptr<std::int8_t[]> all_of(std::int8_t order) {
  return std::make_shared<std::int8_t[]>(kBrickVoxels, order);
}

}  // namespace

Workspace::Workspace(const GridSpec& grid, std::vector<float> palette_Pa_s_per_m)
    : grid_(grid),
      size_bricks_{bricks_along(grid.size_vox[0]), bricks_along(grid.size_vox[1]),
                   bricks_along(grid.size_vox[2])},
      mu_codes_(kBrickVoxels, 0),
      slots_(1) {
  slots_[0].labels.orders = all_of(kOrderFree);
  set_palette(std::move(palette_Pa_s_per_m));
  directory_.resize(static_cast<std::size_t>(size_bricks_[0]) * static_cast<std::size_t>(size_bricks_[1]) *
                    static_cast<std::size_t>(size_bricks_[2]));
}

void Workspace::set_palette(std::vector<float> palette_Pa_s_per_m) {
  if (const core::Status checked = check_palette(palette_Pa_s_per_m); !checked)
    throw std::invalid_argument(checked.message());
  palette_ = std::move(palette_Pa_s_per_m);
}

std::vector<BrickKey> Workspace::bricks() const {
  std::vector<BrickKey> keys;
  keys.reserve(brick_count());
  VoxelBox{{}, size_bricks_}.for_each([&](Index3 v) {
    if (has_brick({v})) keys.push_back({v});
  });
  return keys;
}

std::size_t Workspace::bytes() const noexcept {
  std::size_t labels = 0;
  for (const Slot& slot : slots_) labels += slot.labels.bytes();
  return directory_.size() * sizeof(directory_[0]) + slots_.size() * sizeof(slots_[0]) + mu_codes_.size() +
         labels;
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

/// Gives the brick new memory of its own.
std::uint32_t Workspace::make_slot(BrickKey key, BrickLabels labels) {
  remove_brick(key);
  std::uint32_t slot;
  if (free_slots_.empty()) {
    slot = static_cast<std::uint32_t>(slots_.size());
    slots_.emplace_back();
    mu_codes_.resize(slots_.size() * kBrickVoxels);
  } else {
    slot = free_slots_.back();
    free_slots_.pop_back();
  }
  slots_[slot] = {1, false, std::move(labels)};
  directory_[directory_index(key)] = slot;
  ++brick_count_;
  return slot;
}

std::uint8_t* Workspace::make_brick(BrickKey key, BrickLabels labels) {
  return codes_at(make_slot(key, std::move(labels)));
}

void Workspace::fill_brick(BrickKey key, std::uint8_t mu_code, std::int8_t order, std::uint16_t object) {
  remove_brick(key);
  const auto alike = std::find_if(uniform_slots_.begin(), uniform_slots_.end(), [&](std::uint32_t slot) {
    const BrickLabels& labels = slots_[slot].labels;
    return labels.object == object && codes_at(slot)[0] == mu_code && labels.orders[0] == order;
  });
  if (alike != uniform_slots_.end()) {
    ++slots_[*alike].users;
    directory_[directory_index(key)] = *alike;
    ++brick_count_;
    return;
  }
  const std::uint32_t slot = make_slot(key, {all_of(order), nullptr, object});
  slots_[slot].uniform = true;
  std::fill_n(codes_at(slot), kBrickVoxels, mu_code);
  uniform_slots_.push_back(slot);
}

void Workspace::copy_brick(const Workspace& from, BrickKey key) {
  const std::uint32_t source = from.directory_[directory_index(key)];
  if (source == 0) return remove_brick(key);
  const Slot& slot = from.slots_[source];
  const std::uint8_t* const codes = from.mu_codes_.data() + source * kBrickVoxels;
  if (slot.uniform) return fill_brick(key, codes[0], slot.labels.orders[0], slot.labels.object);
  std::copy_n(codes, kBrickVoxels, make_brick(key, slot.labels));
}

Workspace::MutableBrick Workspace::edit_brick(BrickKey key) {
  std::uint32_t slot = directory_[directory_index(key)];
  if (slot == 0 || slots_[slot].uniform) {
    const std::uint8_t code = codes_at(slot)[0];
    slot = make_slot(key, BrickLabels(slots_[slot].labels));
    std::fill_n(codes_at(slot), kBrickVoxels, code);
  }
  BrickLabels& labels = slots_[slot].labels;
  if (labels.orders.use_count() > 1) {
    auto own = std::make_shared_for_overwrite<std::int8_t[]>(kBrickVoxels);
    std::copy_n(labels.orders.get(), kBrickVoxels, own.get());
    labels.orders = std::move(own);
  }
  if (labels.objects.use_count() != 1) {
    auto own = std::make_shared_for_overwrite<std::uint16_t[]>(kBrickVoxels);
    view(slot).copy_objects(own.get());
    labels.objects = std::move(own);
  }
  return {codes_at(slot), labels.orders.get(), labels.objects.get()};
}

void Workspace::remove_brick(BrickKey key) {
  std::uint32_t& place = directory_[directory_index(key)];
  if (place == 0) return;
  Slot& slot = slots_[place];
  if (--slot.users == 0) {
    if (slot.uniform) std::erase(uniform_slots_, place);
    slot.labels = {};
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

}  // namespace phantom::workspace
