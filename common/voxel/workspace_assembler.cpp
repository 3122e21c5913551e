#include "common/voxel/workspace_assembler.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include "common/voxel/palette.hpp"
#include "common/voxel/workspace_hash.hpp"

namespace phantom::voxel {
namespace {

constexpr std::int32_t kMostBricks = 8192 / kBrickEdge;  // along an axis (idl: size 1…8192)

bool possible(BrickKey key) {
  const auto inside = [](std::int32_t i) { return i >= 0 && i < kMostBricks; };
  return inside(key.x) && inside(key.y) && inside(key.z);
}

core::Status check(const VersionDescription& description) {
  const GridSpec& grid = description.grid;
  if (!grid.origin_m.allFinite())
    return core::Status::invalid_argument("workspace version: origin is not finite");
  if (!(std::isfinite(grid.voxel_size_m) && grid.voxel_size_m > 0)) {
    return core::Status::invalid_argument("workspace version: voxel size is not above 0");
  }
  for (const std::int32_t size : grid.size_vox) {
    if (size < 1 || size > kMostBricks * kBrickEdge) {
      return core::Status::invalid_argument("workspace version: size of " + std::to_string(size) +
                                            " voxels; allowed: 1 to 8192");
    }
  }
  return check_palette(description.palette_Pa_s_per_m);
}

}  // namespace

core::Status WorkspaceAssembler::put_brick(BrickKey key, std::uint64_t version,
                                           std::span<const std::uint8_t> bytes) {
  if (!possible(key)) {
    return core::Status::invalid_argument("workspace brick (" + std::to_string(key.x) + ", " +
                                          std::to_string(key.y) + ", " + std::to_string(key.z) +
                                          "): outside of any workspace");
  }
  auto data = std::make_shared<BrickData>();
  if (core::Status decoded = decode_brick(bytes, *data); !decoded) return decoded;
  forget(key);
  Held held{version, brick_hash(key, data->view()), data,
            *std::max_element(data->mu_code.begin(), data->mu_code.end())};
  hash_sum_ += held.hash;
  held_.emplace(key, std::move(held));
  try_commit();
  return core::Status::ok();
}

void WorkspaceAssembler::remove_brick(BrickKey key) {
  forget(key);
  try_commit();
}

void WorkspaceAssembler::forget(BrickKey key) {
  const auto found = held_.find(key);
  if (found == held_.end()) return;
  hash_sum_ -= found->second.hash;
  held_.erase(found);
}

core::Status WorkspaceAssembler::commit(const VersionDescription& description) {
  if (core::Status checked = check(description); !checked) return checked;
  pending_ = description;
  try_commit();
  return core::Status::ok();
}

std::size_t WorkspaceAssembler::bricks_expected() const {
  return pending_ ? pending_->brick_count : current_ ? current_->brick_count() : 0;
}

void WorkspaceAssembler::try_commit() {
  if (!pending_) return;
  if (held_.size() > pending_->brick_count) drop_left_overs();
  if (!fits(*pending_)) return;
  build(*pending_);
  pending_.reset();
}

void WorkspaceAssembler::drop_left_overs() {
  // A server's first version is newer than any of its predecessor's: left-overs are the bricks of lowest
  // version. Only if the rest then has the committed hash are they dropped; else they may be bricks that the
  // next version will name.
  std::vector<std::pair<std::uint64_t, BrickKey>> by_version;
  by_version.reserve(held_.size());
  for (const auto& [key, held] : held_) by_version.emplace_back(held.version, key);
  std::sort(by_version.begin(), by_version.end());
  const std::size_t surplus = held_.size() - pending_->brick_count;
  if (pending_->brick_count > 0 && by_version[surplus - 1].first == by_version[surplus].first) return;
  std::uint64_t rest = hash_sum_;
  for (std::size_t i = 0; i < surplus; ++i) rest -= held_.at(by_version[i].second).hash;
  if (header_hash(pending_->grid, pending_->palette_Pa_s_per_m) + rest != pending_->content_hash) return;
  for (std::size_t i = 0; i < surplus; ++i) held_.erase(by_version[i].second);
  hash_sum_ = rest;
}

bool WorkspaceAssembler::fits(const VersionDescription& description) const {
  if (held_.size() != description.brick_count) return false;
  if (header_hash(description.grid, description.palette_Pa_s_per_m) + hash_sum_ != description.content_hash)
    return false;
  const auto& size = description.grid.size_vox;
  return std::all_of(held_.begin(), held_.end(), [&](const auto& entry) {
    const auto& [key, held] = entry;
    return key.x * kBrickEdge < size[0] && key.y * kBrickEdge < size[1] && key.z * kBrickEdge < size[2] &&
           held.greatest_code < description.palette_Pa_s_per_m.size();
  });
}

void WorkspaceAssembler::build(const VersionDescription& description) {
  auto built = std::make_shared<Workspace>(description.grid, description.palette_Pa_s_per_m);
  built->version = description.version;
  built->reserve_bricks(held_.size());
  for (auto& [key, held] : held_) {
    const Workspace::BrickView from = held.data ? held.data->view() : current_->brick(key);
    const Workspace::MutableBrick to = built->make_brick(key);
    std::memcpy(to.mu_code, from.mu_code, kBrickVoxels);
    std::memcpy(to.order, from.order, kBrickVoxels);
    std::memcpy(to.object, from.object, kBrickVoxels * 2);
  }
  for (auto& [key, held] : held_) held.data.reset();  // from now on it stands in current_
  current_ = std::move(built);
}

}  // namespace phantom::voxel
