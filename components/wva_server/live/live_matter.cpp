#include "components/wva_server/live/live_matter.hpp"

#include <algorithm>
#include <bit>

#include "common/fusion/fused_block.hpp"

namespace phantom::wva_server {
namespace {

using workspace::BrickKey;
using workspace::Index3;
using workspace::VoxelBox;

/// One row of a block: eight bits of a word, which a block never crosses.
std::uint8_t row_of(const workspace::BitVolume& bits, Index3 first, std::int32_t y, std::int32_t z) {
  return static_cast<std::uint8_t>(bits.row(y, z)[first.x >> 6] >> (first.x & 63));
}
void set_row(workspace::BitVolume& bits, Index3 first, std::int32_t y, std::int32_t z, std::uint8_t row) {
  std::uint64_t& word = bits.row(y, z)[first.x >> 6];
  word = (word & ~(std::uint64_t{0xFF} << (first.x & 63))) | std::uint64_t{row} << (first.x & 63);
}

/// Calls `each` with y and z of the rows of a block in the grid.
template <class Each>
void for_rows(const workspace::GridSpec& grid, Index3 block, Each each) {
  const Index3 first = fusion::kBlockEdge * block;
  for (std::int32_t z = first.z; z < std::min(first.z + fusion::kBlockEdge, grid.size_vox[2]); ++z)
    for (std::int32_t y = first.y; y < std::min(first.y + fusion::kBlockEdge, grid.size_vox[1]); ++y)
      each(y, z);
}

/// A layer of that thickness: whatever is in it is near.
workspace::LayerProfile near_profile(int tolerance_vox) { return {{tolerance_vox}, {1.0F}, 1.0F, 0}; }

}  // namespace

bool LiveIntake::put(messages::OccupancyChange sample, core::Nanoseconds received_ns) {
  received_ns_ = received_ns;
  cameras_ = std::move(sample.cameras);
  const bool is_next =
      sample.stamp.session == newest_.session && sample.stamp.sequence_number == newest_.sequence_number + 1;
  newest_ = sample.stamp;
  if (sample.whole) {
    blocks_.clear();
    exposed_ns_.reset();
    follows_ = waiting_ = whole_ = true;
  } else if (!follows_ || !is_next) {
    missed_ += follows_ ? 1 : 0;
    restart();
    return false;
  }
  for (const messages::OccupancyBlock& block : sample.blocks)
    blocks_.insert_or_assign({block.x, block.y, block.z}, block);
  waiting_ = waiting_ || !sample.blocks.empty();
  if (!sample.blocks.empty() && sample.image_age_s >= 0.0) {
    const core::Nanoseconds exposed_ns = received_ns - core::from_seconds(sample.image_age_s);
    exposed_ns_ = std::min(exposed_ns_.value_or(exposed_ns), exposed_ns);
  }
  // Nobody takes them: what waits is bounded all the same, and comes whole again.
  if (blocks_.size() > 4 * messages::kMaxOccupancyBlocks) {
    restart();
    return false;
  }
  return true;
}

void LiveIntake::restart() {
  follows_ = waiting_ = whole_ = false;
  blocks_.clear();
  exposed_ns_.reset();
}

std::optional<LiveIntake::Taken> LiveIntake::take() {
  if (!waiting_) return std::nullopt;
  Taken taken{whole_, {}, exposed_ns_};
  taken.blocks.reserve(blocks_.size());
  for (const auto& [place, block] : blocks_) taken.blocks.push_back(block);
  waiting_ = whole_ = false;
  blocks_.clear();
  exposed_ns_.reset();
  return taken;
}

core::Expected<LiveMatter> LiveMatter::create(const workspace::GridSpec& grid, const LiveRules& rules) {
  auto layers = fusion::IncrementalLayers::create(grid, rules.profile);
  if (!layers) return layers.status();
  constexpr int kMaxTolerance_vox = 20;
  if (rules.tolerance_vox < 0 || rules.tolerance_vox > kMaxTolerance_vox)
    return core::Status::invalid_argument("tolerance of live matter: " + std::to_string(rules.tolerance_vox) +
                                          " voxels; allowed: 0 to 20");
  std::optional<fusion::IncrementalLayers> near;
  if (rules.tolerance_vox > 0) {
    auto made = fusion::IncrementalLayers::create(grid, near_profile(rules.tolerance_vox));
    if (!made) return made.status();
    near = std::move(made).value();
  }
  return LiveMatter(grid, rules, std::move(layers).value(), std::move(near));
}

LiveMatter::LiveMatter(const workspace::GridSpec& grid, const LiveRules& rules,
                       fusion::IncrementalLayers layers, std::optional<fusion::IncrementalLayers> near)
    : grid_(grid),
      profile_(rules.profile),
      min_voxels_(static_cast<std::size_t>(std::max(1, rules.min_voxels))),
      layers_(std::move(layers)),
      near_layers_(std::move(near)),
      seen_(grid.size_vox),
      model_(grid.size_vox),
      near_(grid.size_vox),
      unexplained_(grid.size_vox),
      left_(grid.size_vox),
      kept_(grid.size_vox),
      live_(grid.size_vox),
      blocks_(fusion::blocks_of(grid)),
      is_touched_(blocks_.voxel_count()),
      is_seen_(blocks_.voxel_count()),
      is_unexplained_(blocks_.voxel_count()) {}

void LiveMatter::touch(Index3 block) {
  std::uint8_t& touched = is_touched_[blocks_.index(block)];
  if (touched != 0) return;
  touched = 1;
  touched_.push_back(block);
}

void LiveMatter::set_block(Index3 block, const std::array<std::uint64_t, 8>& bits) {
  const Index3 first = fusion::kBlockEdge * block;
  const std::int32_t columns = grid_.size_vox[0] - first.x;
  const auto in_grid = static_cast<std::uint8_t>(columns >= 8 ? 0xFF : (1 << columns) - 1);
  bool any = false;
  for_rows(grid_, block, [&](std::int32_t y, std::int32_t z) {
    const auto row = static_cast<std::uint8_t>(
        (bits[static_cast<std::size_t>(z - first.z)] >> (8 * (y - first.y)) & 0xFF) & in_grid);
    any = any || row != 0;
    set_row(seen_, first, y, z, row);
  });
  is_seen_[blocks_.index(block)] = any ? 1 : 0;
  touch(block);
}

void LiveMatter::take(const LiveIntake::Taken& seen) {
  if (seen.whole) {
    std::vector<std::uint8_t> told(is_seen_.size());
    for (const messages::OccupancyBlock& block : seen.blocks) {
      const Index3 place{block.x, block.y, block.z};
      if (blocks_.contains(place)) told[blocks_.index(place)] = 1;
    }
    blocks_.for_each([&](Index3 place) {
      const std::size_t i = blocks_.index(place);
      if (is_seen_[i] != 0 && told[i] == 0) set_block(place, {});
    });
  }
  for (const messages::OccupancyBlock& block : seen.blocks) {
    const Index3 place{block.x, block.y, block.z};
    if (blocks_.contains(place)) set_block(place, block.bits);
  }
}

/// Notes which voxels of a brick are near to the model. `orders`: null: none.
void LiveMatter::note_near(BrickKey key, const std::int8_t* orders) {
  const VoxelBox box = workspace::box_of(key).intersection(VoxelBox::of(grid_));
  const Index3 end = box.end();
  for (std::int32_t z = box.min.z; z < end.z; ++z) {
    for (std::int32_t y = box.min.y; y < end.y; ++y) {
      std::uint64_t row = 0;
      for (std::int32_t x = box.min.x; orders != nullptr && x < end.x; ++x)
        row |= std::uint64_t{orders[workspace::brick_offset({x, y, z})] != workspace::kOrderFree} << (x & 63);
      std::uint64_t& word = near_.row(y, z)[box.min.x >> 6];
      word = (word & ~(std::uint64_t{0xFFFFFFFF} << (box.min.x & 63))) | row;
    }
  }
}

void LiveMatter::set_model(const workspace::BitVolume& solid) {
  std::vector<Index3> changed;
  blocks_.for_each([&](Index3 block) {
    const Index3 first = fusion::kBlockEdge * block;
    bool differs = false;
    for_rows(grid_, block, [&](std::int32_t y, std::int32_t z) {
      differs = differs || row_of(solid, first, y, z) != row_of(model_, first, y, z);
    });
    if (differs) changed.push_back(block);
  });
  model_ = solid;
  if (!near_layers_) {
    near_ = solid;
    for (const Index3 block : changed) touch(block);
    return;
  }
  const fusion::LayersChange& change = near_layers_->update(solid, changed);
  const workspace::ObjectBricks bricks = near_layers_->bricks();
  for (const auto* keys : {&change.changed, &change.removed}) {
    for (const BrickKey key : *keys) {
      note_near(key, bricks.orders(key));
      VoxelBox::between(fusion::block_of(workspace::corner_of(key)),
                        fusion::block_of(workspace::corner_of(key)) + Index3{4, 4, 4})
          .intersection(blocks_)
          .for_each([&](Index3 block) { touch(block); });
    }
  }
}

/// Renews what the model does not explain of a block. Returns whether it differs.
bool LiveMatter::renew(Index3 block) {
  const Index3 first = fusion::kBlockEdge * block;
  bool differs = false, any = false;
  for_rows(grid_, block, [&](std::int32_t y, std::int32_t z) {
    const auto now = static_cast<std::uint8_t>(row_of(seen_, first, y, z) & ~row_of(near_, first, y, z));
    differs = differs || now != row_of(unexplained_, first, y, z);
    any = any || now != 0;
    set_row(unexplained_, first, y, z, now);
  });
  std::uint8_t& listed = is_unexplained_[blocks_.index(block)];
  if (any && listed == 0) {
    listed = 1;
    unexplained_blocks_.push_back(block);
  }
  return differs;
}

/// Moves the voxels that are connected with one, through 26 neighbours, from left_ to part_.
void LiveMatter::collect_part(Index3 from) {
  const VoxelBox grid = VoxelBox::of(grid_);
  part_.assign(1, from);
  left_.flip(from.x, from.y, from.z);
  for (std::size_t next = 0; next < part_.size(); ++next) {
    VoxelBox{part_[next], {1, 1, 1}}.grown(1).intersection(grid).for_each([&](Index3 v) {
      if (!left_.get(v)) return;
      left_.flip(v.x, v.y, v.z);
      part_.push_back(v);
    });
  }
}

/// Puts what is in parts that are large enough into kept_.
void LiveMatter::keep_large_parts() {
  for (const Index3 block : unexplained_blocks_) {
    const Index3 first = fusion::kBlockEdge * block;
    for_rows(grid_, block, [&](std::int32_t y, std::int32_t z) {
      set_row(left_, first, y, z, row_of(unexplained_, first, y, z));
    });
  }
  for (const Index3 block : unexplained_blocks_) {
    const Index3 first = fusion::kBlockEdge * block;
    for_rows(grid_, block, [&](std::int32_t y, std::int32_t z) {
      while (const std::uint8_t row = row_of(left_, first, y, z)) {
        collect_part({first.x + std::countr_zero(row), y, z});
        if (part_.size() < min_voxels_) continue;
        for (const Index3 v : part_) kept_.set(v.x, v.y, v.z);
      }
    });
  }
}

/// Makes what was kept of a block what is live there. Returns whether that differs.
bool LiveMatter::take_kept(Index3 block) {
  const Index3 first = fusion::kBlockEdge * block;
  bool differs = false;
  const auto count = [&](std::uint8_t row, std::int32_t y, std::int32_t z, double sign) {
    for (; row != 0; row = static_cast<std::uint8_t>(row & (row - 1)))
      sum_ += sign * Eigen::Vector3d(first.x + std::countr_zero(row), y, z);
  };
  for_rows(grid_, block, [&](std::int32_t y, std::int32_t z) {
    const std::uint8_t before = row_of(live_, first, y, z), now = row_of(kept_, first, y, z);
    set_row(kept_, first, y, z, 0);
    if (before == now) return;
    differs = true;
    const auto came = static_cast<std::uint8_t>(now & ~before),
               went = static_cast<std::uint8_t>(before & ~now);
    voxels_ += static_cast<std::size_t>(std::popcount(came));
    voxels_ -= static_cast<std::size_t>(std::popcount(went));
    count(came, y, z, 1.0);
    count(went, y, z, -1.0);
    set_row(live_, first, y, z, now);
  });
  return differs;
}

LiveMatter::Update LiveMatter::update() {
  bool differs = false;
  for (const Index3 block : touched_) {
    is_touched_[blocks_.index(block)] = 0;
    differs = renew(block) || differs;
  }
  touched_.clear();
  if (!differs) return {};
  keep_large_parts();
  // Blocks that were listed before are, too, so that what is gone of them is seen.
  std::vector<Index3> changed;
  std::erase_if(unexplained_blocks_, [&](Index3 block) {
    if (take_kept(block)) changed.push_back(block);
    const Index3 first = fusion::kBlockEdge * block;
    bool any = false;
    for_rows(grid_, block,
             [&](std::int32_t y, std::int32_t z) { any = any || row_of(unexplained_, first, y, z) != 0; });
    is_unexplained_[blocks_.index(block)] = any ? 1 : 0;
    return !any;
  });
  if (changed.empty()) return {};
  const fusion::LayersChange& change = layers_.update(live_, changed);
  Update update{layers_.bricks(), change.changed};
  update.touched.insert(update.touched.end(), change.removed.begin(), change.removed.end());
  return update;
}

std::optional<Eigen::Vector3d> LiveMatter::middle_m() const {
  if (voxels_ == 0) return std::nullopt;
  const Eigen::Vector3d address = sum_ / static_cast<double>(voxels_) + Eigen::Vector3d::Constant(0.5);
  return grid_.origin_m + grid_.voxel_size_m.sides_m().cwiseProduct(address);
}

}  // namespace phantom::wva_server
