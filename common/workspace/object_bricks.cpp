#include "common/workspace/object_bricks.hpp"

#include <algorithm>
#include <array>
#include <cstring>

namespace phantom::workspace {
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

}  // namespace

std::shared_ptr<std::int8_t[]> BrickMemory::take() {
  constexpr std::size_t kPiece = 512;  // bricks, that is 16 MiB
  const std::lock_guard lock(mutex_);
  if (!spare_.empty()) {
    auto orders = std::move(spare_.back());
    spare_.pop_back();
    return orders;
  }
  if (left_in_piece_ == 0) {
    left_in_piece_ = std::clamp<std::size_t>(left_, 1, kPiece);
    left_ -= std::min(left_, left_in_piece_);
    next_ = std::make_shared_for_overwrite<std::int8_t[]>(left_in_piece_ * kBrickVoxels);
    prefer_large_pages(next_.get(), left_in_piece_ * kBrickVoxels);
  }
  auto orders = next_;
  next_ = --left_in_piece_ == 0 ? nullptr : std::shared_ptr<std::int8_t[]>(next_, next_.get() + kBrickVoxels);
  return orders;
}

void BrickMemory::give_back(std::shared_ptr<std::int8_t[]> orders) {
  const std::lock_guard lock(mutex_);
  spare_.push_back(std::move(orders));
}

ObjectBricks::ObjectBricks(std::vector<Part> parts) {
  std::sort(parts.begin(), parts.end(), [](const Part& a, const Part& b) { return a.key < b.key; });
  keys_.reserve(parts.size());
  orders_.reserve(parts.size());
  for (Part& part : parts) {
    keys_.push_back(part.key);
    orders_.push_back(std::move(part.orders));
  }
}

/// Returns where the brick's orders are kept; null if the object has nothing there.
const std::shared_ptr<std::int8_t[]>* ObjectBricks::find(BrickKey key) const noexcept {
  const auto found = std::lower_bound(keys_.begin(), keys_.end(), key);
  return found == keys_.end() || *found != key ? nullptr
                                               : &orders_[static_cast<std::size_t>(found - keys_.begin())];
}

const std::int8_t* ObjectBricks::orders(BrickKey key) const noexcept {
  const auto* const own = find(key);
  return own == nullptr ? nullptr : *own ? own->get() : all_interior().data();
}

std::shared_ptr<std::int8_t[]> ObjectBricks::share(BrickKey key) const noexcept {
  const auto* const own = find(key);
  return own == nullptr ? nullptr : *own;
}

bool ObjectBricks::is_interior(BrickKey key) const noexcept {
  const auto* const own = find(key);
  return own != nullptr && !*own;
}

std::int8_t* ObjectBricks::edit(BrickKey key) {
  const auto* const found = find(key);
  if (found == nullptr) return nullptr;
  auto& own = orders_[static_cast<std::size_t>(found - orders_.data())];
  if (!own) {
    own = std::make_shared_for_overwrite<std::int8_t[]>(kBrickVoxels);
    std::memcpy(own.get(), all_interior().data(), kBrickVoxels);
  }
  return own.get();
}

std::int8_t ObjectBricks::at(Index3 v) const noexcept {
  const std::int8_t* brick = orders(brick_of(v));
  return brick == nullptr ? kOrderFree : brick[brick_offset(v)];
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
  const auto own =
      std::count_if(orders_.begin(), orders_.end(), [](const auto& orders) { return orders != nullptr; });
  return static_cast<std::size_t>(own) * kBrickVoxels + keys_.capacity() * sizeof(BrickKey) +
         orders_.capacity() * sizeof(orders_[0]);
}

}  // namespace phantom::workspace
