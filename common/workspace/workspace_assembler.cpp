#include "common/workspace/workspace_assembler.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/workspace/profile.hpp"
#include "common/workspace/workspace_hash.hpp"

namespace phantom::workspace {
namespace {

constexpr VoxelBox kPossibleBricks{{}, {kMaxBricks, kMaxBricks, kMaxBricks}};

bool same_grid(const GridSpec& a, const GridSpec& b) {
  return a.origin_m == b.origin_m && a.voxel_size_m == b.voxel_size_m && a.size_vox == b.size_vox;
}

/// Returns whether nobody else holds the volume. Former holders have then finished reading it.
bool is_sole(const std::shared_ptr<Workspace>& volume) {
  if (volume.use_count() != 1) return false;
  // Reading the count does not synchronise with the other holders' earlier reads; changing it does.
  std::shared_ptr<Workspace>(volume).reset();
  return true;
}

/// Puts a brick into the workspace with as little memory as its content needs.
void store_brick(BrickKey key, const BrickContent& content, Workspace& workspace) {
  const auto& [brick, facts] = content;
  const bool several = facts.object == BrickFacts::kSeveral;
  if (!several && facts.uniform)
    return workspace.fill_brick(key, brick.mu_code[0], brick.order[0], facts.object);
  BrickLabels labels{std::make_shared_for_overwrite<std::int8_t[]>(kBrickVoxels), nullptr, facts.object};
  std::copy(brick.order.begin(), brick.order.end(), labels.orders.get());
  if (several) {
    labels.objects = std::make_shared_for_overwrite<std::uint16_t[]>(kBrickVoxels);
    std::copy(brick.object.begin(), brick.object.end(), labels.objects.get());
  }
  std::copy(brick.mu_code.begin(), brick.mu_code.end(), workspace.make_brick(key, std::move(labels)));
}

constexpr std::size_t kMaxReserved =
    32768;  // bricks: 1 GiB of addresses, of which only what is used becomes memory

constexpr std::size_t kCodeBytes = kBrickVoxels, kOrderBytes = kBrickVoxels, kObjectBytes = 2 * kBrickVoxels;
constexpr std::size_t kNodeBytes = 320;  // of a brick in maps and directories, and its share of heap blocks
constexpr std::uint32_t kNotUniform = UINT32_MAX;

/// Returns a number for what a uniform brick is full of: bricks of one kind share their memory.
std::uint32_t kind_of(const BrickContent& content) {
  const auto& [brick, facts] = content;
  if (!facts.uniform || facts.object == BrickFacts::kSeveral) return kNotUniform;
  const auto order = static_cast<std::uint8_t>(brick.order[0]);
  return std::uint32_t{facts.object} << 16 | std::uint32_t{brick.mu_code[0]} << 8 | order;
}

/// Returns the memory of a brick, without what it shares with others of its kind.
std::size_t bytes_of(const BrickContent& content, std::uint32_t kind, std::size_t packed) {
  if (kind != kNotUniform) return kNodeBytes + packed;
  const bool several = content.facts.object == BrickFacts::kSeveral;
  return kNodeBytes + std::max(packed, kCodeBytes + kOrderBytes + (several ? kObjectBytes : 0));
}

std::size_t shared_bytes(std::uint32_t kind) { return kind == kNotUniform ? 0 : kCodeBytes + kOrderBytes; }

/// Adds room for some more bricks, because growing an array later would move all of its content.
std::size_t with_room(std::size_t bricks) { return bricks + bricks / 8 + 64; }

}  // namespace

VersionDescription description_of(const Workspace& workspace, std::uint64_t content_hash) {
  return {workspace.version, workspace.grid(), workspace.palette(),
          static_cast<std::uint32_t>(workspace.brick_count()), content_hash};
}

core::Status check(const VersionDescription& description) {
  const GridSpec& grid = description.grid;
  if (!grid.origin_m.allFinite())
    return core::Status::invalid_argument("workspace version: origin is not finite");
  if (core::Status checked = check_voxel_size(grid.voxel_size_m); !checked)
    return core::Status::invalid_argument("workspace version: voxel size " + checked.message());
  for (const std::int32_t size : grid.size_vox) {
    if (size < 1 || size > kMaxBricks * kBrickEdge) {
      return core::Status::invalid_argument("workspace version: size of " + std::to_string(size) +
                                            " voxels; allowed: 1 to 8192");
    }
  }
  return check_palette(description.palette_Pa_s_per_m);
}

core::Status WorkspaceAssembler::put_brick(BrickKey key, std::uint64_t version,
                                           std::span<const std::uint8_t> bytes) {
  if (!kPossibleBricks.contains(key)) {
    return core::Status::invalid_argument("workspace brick (" + std::to_string(key.x) + ", " +
                                          std::to_string(key.y) + ", " + std::to_string(key.z) +
                                          "): outside of any workspace");
  }
  if (bytes.empty()) {
    remove_brick(key);
    return core::Status::ok();
  }
  BrickContent& content = *scratch_;
  if (core::Status decoded = decode_brick(bytes, content); !decoded) return decoded;
  const std::uint32_t kind = kind_of(content);
  Held held{version,
            brick_hash(key, content.voxels.view()),
            {},
            forming_ && forming_->grid().contains(corner_of(key)),
            content.facts.greatest_code,
            content.facts.greatest_fluid_code,
            kind,
            bytes_of(content, kind, bytes.size()),
            kNodeBytes + bytes.size()};
  if (core::Status room = check_room(key, held); !room) return room;
  forget(key);
  if (held.formed) {
    store_brick(key, content, *forming_);
  } else {
    held.packed.assign(bytes.begin(), bytes.end());
  }
  hash_sum_ += held.hash;
  bytes_ += held.bytes;
  received_bytes_ += held.received_bytes;
  if (kind != kNotUniform && kinds_[kind]++ == 0) bytes_ += shared_bytes(kind);
  Tally& tally = tallies_[version];
  ++tally.count;
  tally.hash += held.hash;
  held_.emplace(key, std::move(held));
  changed_.insert(key);
  try_commit();
  return core::Status::ok();
}

/// Refuses a brick, which would replace any that is held at its place, if there is no room for it.
core::Status WorkspaceAssembler::check_room(BrickKey key, const Held& held) const {
  const auto present = held_.find(key);
  const bool is_new = present == held_.end();
  if (is_new && held_.size() >= kMaxBricksInAll)
    return {core::ErrorCode::kResourceExhausted,
            "more bricks than a workspace can have; allowed: " + std::to_string(kMaxBricksInAll)};
  std::size_t after = bytes_ + held.bytes - (is_new ? 0 : present->second.bytes);
  if (!kinds_.contains(held.kind)) after += shared_bytes(held.kind);
  const std::size_t received =
      received_bytes_ + held.received_bytes - (is_new ? 0 : present->second.received_bytes);
  const auto more_than = [](const std::string& what, std::size_t most_bytes) {
    return core::Status{
        core::ErrorCode::kResourceExhausted,
        what + " more than " + std::to_string(most_bytes >> 20) + " MiB, which is all that is allowed"};
  };
  if (after > most_bytes_) return more_than("the workspace takes", most_bytes_);
  if (received > most_received_bytes_)
    return more_than("the bricks of a workspace that is not in force take", most_received_bytes_);
  return core::Status::ok();
}

void WorkspaceAssembler::remove_brick(BrickKey key) {
  forget(key);
  try_commit();
}

void WorkspaceAssembler::forget(BrickKey key) {
  const auto found = held_.find(key);
  if (found == held_.end()) return;
  const Held& held = found->second;
  const auto tally = tallies_.find(held.version);
  if (--tally->second.count == 0) {
    tallies_.erase(tally);
  } else {
    tally->second.hash -= held.hash;
  }
  hash_sum_ -= held.hash;
  bytes_ -= held.bytes;
  received_bytes_ -= held.received_bytes;
  if (held.kind != kNotUniform && --kinds_.at(held.kind) == 0) {
    kinds_.erase(held.kind);
    bytes_ -= shared_bytes(held.kind);
  }
  if (held.formed) forming_->remove_brick(key);
  held_.erase(found);
  // Bricks that come and go before any version names them must leave nothing behind.
  if (current_ && current_->grid().contains(corner_of(key)) && current_->has_brick(key)) {
    changed_.insert(key);
  } else {
    changed_.erase(key);
  }
}

core::Status WorkspaceAssembler::commit(const VersionDescription& description) {
  if (core::Status checked = check(description); !checked) return checked;
  if (description.brick_count > kMaxBricksInAll)
    return core::Status::invalid_argument("workspace version: " + std::to_string(description.brick_count) +
                                          " bricks; allowed: at most " + std::to_string(kMaxBricksInAll));
  pending_ = description;
  if (!packed_) take_up(description);
  return core::Status::ok();
}

/// Prepares for a committed version, and builds it if it is complete.
void WorkspaceAssembler::take_up(const VersionDescription& description) {
  if (current_ && same_grid(current_->grid(), description.grid)) {
    end_forming();
  } else {
    begin_forming(description);
  }
  try_commit();
}

void WorkspaceAssembler::keep_packed(bool packed) {
  if (std::exchange(packed_, packed) == packed) return;
  if (packed) {
    end_forming();
  } else if (pending_) {
    take_up(VersionDescription(*pending_));
  }
}

void WorkspaceAssembler::begin_forming(const VersionDescription& description) {
  if (forming_ && same_grid(forming_->grid(), description.grid)) return;
  end_forming();
  forming_ = std::make_shared<Workspace>(description.grid, description.palette_Pa_s_per_m);
  forming_->reserve_more(with_room(std::min<std::size_t>(description.brick_count, kMaxReserved)));
}

void WorkspaceAssembler::end_forming() {
  if (!forming_) return;
  for (auto& [key, held] : held_) {
    if (!held.formed) continue;
    held.packed = encode_brick(forming_->brick(key));
    held.formed = false;
  }
  forming_ = nullptr;
}

std::size_t WorkspaceAssembler::bricks_expected() const {
  return pending_ ? pending_->brick_count : current_ ? current_->brick_count() : 0;
}

void WorkspaceAssembler::try_commit() {
  if (!pending_ || packed_) return;
  if (held_.size() > pending_->brick_count) drop_left_overs();
  if (!fits(*pending_)) return;
  build(*pending_);
  pending_.reset();
}

void WorkspaceAssembler::drop_left_overs() {
  // The first version of a server is newer than any of its predecessor's and names all of its bricks. So
  // left-over bricks are those with the lowest versions. They are dropped only if the remaining ones then
  // have the committed hash; otherwise they may be bricks that a later removal or version explains.
  const std::size_t surplus = held_.size() - pending_->brick_count;
  Tally oldest;
  auto rest = tallies_.begin();
  for (; rest != tallies_.end() && oldest.count < surplus; ++rest) {
    oldest.count += rest->second.count;
    oldest.hash += rest->second.hash;
  }
  if (oldest.count != surplus) return;
  const std::uint64_t header = header_hash(pending_->grid, pending_->palette_Pa_s_per_m);
  if (header + hash_sum_ - oldest.hash != pending_->content_hash) return;
  std::vector<BrickKey> gone;
  for (const auto& [key, held] : held_) {
    if (rest == tallies_.end() || held.version < rest->first) gone.push_back(key);
  }
  for (const BrickKey key : gone) forget(key);
}

bool WorkspaceAssembler::fits(const VersionDescription& description) const {
  if (held_.size() != description.brick_count) return false;
  if (header_hash(description.grid, description.palette_Pa_s_per_m) + hash_sum_ != description.content_hash)
    return false;
  return std::all_of(held_.begin(), held_.end(), [&](const auto& entry) {
    const auto& [key, held] = entry;
    return description.grid.contains(corner_of(key)) &&
           held.greatest_code < description.palette_Pa_s_per_m.size();
  });
}

bool WorkspaceAssembler::spare_usable(const GridSpec& grid) const {
  return spare_ && is_sole(spare_) && same_grid(spare_->grid(), grid);
}

void WorkspaceAssembler::write_brick(Workspace& to, BrickKey key) {
  const auto found = held_.find(key);
  if (found == held_.end()) return to.remove_brick(key);
  ++bricks_written_;
  const std::vector<std::uint8_t>& packed = found->second.packed;
  if (packed.empty()) return to.copy_brick(*current_, key);
  if (!decode_brick(packed, *scratch_)) throw std::logic_error("a brick that was checked does not decode");
  store_brick(key, *scratch_, to);
}

void WorkspaceAssembler::build(const VersionDescription& description) {
  bricks_written_ = 0;
  std::shared_ptr<Workspace> built;
  if (forming_) {
    built = std::move(forming_);
    for (const auto& [key, held] : held_) {
      if (!held.formed) write_brick(*built, key);
    }
    bricks_written_ = held_.size();
  } else if (spare_usable(description.grid)) {
    built = std::move(spare_);
    for (const BrickKey key : changed_) spare_behind_.insert(key);
    for (const BrickKey key : spare_behind_) write_brick(*built, key);
  } else {
    built = std::make_shared<Workspace>(description.grid, description.palette_Pa_s_per_m);
    built->reserve_more(with_room(held_.size()));
    for (const auto& [key, held] : held_) write_brick(*built, key);
  }
  built->set_palette(description.palette_Pa_s_per_m);
  built->version = description.version;
  std::uint8_t fluid = 0;
  for (auto& [key, held] : held_) {
    held.formed = false;
    held.packed = {};  // its content is in current_ now
    fluid = std::max(fluid, held.greatest_fluid_code);
  }
  greatest_neighbour_mu_ = static_cast<double>(description.palette_Pa_s_per_m[fluid]);
  current_ = built;
  spare_ = std::move(buffer_);
  spare_behind_ = std::move(changed_);
  changed_.clear();
  buffer_ = std::move(built);
}

void WorkspaceAssembler::prepare() {
  if (!current_) return;
  if (!spare_usable(current_->grid())) {
    if (spare_ && spare_.use_count() > 1) return;
    spare_ = std::make_shared<Workspace>(current_->grid(), current_->palette());
    spare_->reserve_more(with_room(current_->brick_count()));  // first: later it would move all content
    *spare_ = *current_;
  } else {
    // Not copied from held_: bricks received since then may belong to an incomplete version.
    for (const BrickKey key : spare_behind_) spare_->copy_brick(*current_, key);
  }
  spare_behind_.clear();
}

}  // namespace phantom::workspace
