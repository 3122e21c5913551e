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

/// Returns the blocks that hold voxels within a margin of a block's.
VoxelBox blocks_near(Index3 block, std::int32_t margin_vox) {
  return VoxelBox{block, {1, 1, 1}}.grown((margin_vox + fusion::kBlockEdge - 1) / fusion::kBlockEdge);
}

/// A layer of that thickness: whatever is in it is near.
workspace::LayerProfile near_profile(int tolerance_vox) { return {{tolerance_vox}, {1.0F}, 1.0F, 0}; }

}  // namespace

core::Expected<LiveMatter> LiveMatter::create(const workspace::GridSpec& grid, const LiveRules& rules) {
  if (auto layers = fusion::IncrementalLayers::create(grid, rules.profile); !layers) return layers.status();
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
  return LiveMatter(grid, rules, std::move(near));
}

LiveMatter::LiveMatter(const workspace::GridSpec& grid, const LiveRules& rules,
                       std::optional<fusion::IncrementalLayers> near)
    : grid_(grid),
      profile_(rules.profile),
      tolerance_vox_(rules.tolerance_vox),
      min_voxels_(static_cast<std::size_t>(std::max(1, rules.min_voxels))),
      join_vox_(std::max(1, rules.join_vox)),
      near_layers_(std::move(near)),
      seen_(grid.size_vox),
      model_(grid.size_vox),
      near_(grid.size_vox),
      masked_(grid.size_vox),
      unexplained_(grid.size_vox),
      left_(grid.size_vox),
      scratch_(grid.size_vox),
      blocks_(fusion::blocks_of(grid)),
      is_touched_(blocks_.voxel_count()),
      is_seen_(blocks_.voxel_count()),
      is_unexplained_(blocks_.voxel_count()),
      objects_(grid.voxel_size_m.reference_m()) {}

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
    const auto now = static_cast<std::uint8_t>(row_of(seen_, first, y, z) & ~row_of(near_, first, y, z) &
                                               ~row_of(masked_, first, y, z));
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

/// Returns the connected parts that are large enough, put together where they are near: what lies between
/// them was not measured. Drops blocks from the list in which nothing is left.
std::vector<LivePart> LiveMatter::large_parts() {
  std::erase_if(unexplained_blocks_, [&](Index3 block) {
    const Index3 first = fusion::kBlockEdge * block;
    bool any = false;
    for_rows(grid_, block, [&](std::int32_t y, std::int32_t z) {
      const std::uint8_t row = row_of(unexplained_, first, y, z);
      set_row(left_, first, y, z, row);
      any = any || row != 0;
    });
    is_unexplained_[blocks_.index(block)] = any ? 1 : 0;
    return !any;
  });
  std::vector<LivePart> parts;
  for (const Index3 block : unexplained_blocks_) {
    const Index3 first = fusion::kBlockEdge * block;
    for_rows(grid_, block, [&](std::int32_t y, std::int32_t z) {
      while (const std::uint8_t row = row_of(left_, first, y, z)) {
        collect_part({first.x + std::countr_zero(row), y, z});
        if (part_.size() >= min_voxels_) parts.push_back(part_of(part_));
      }
    });
  }
  return joined(std::move(parts), join_vox_);
}

/// Masks the voxels of a part, and those within the tolerance of them along each axis.
void LiveMatter::mask(const LivePart& part) {
  const std::int32_t margin = std::max(1, tolerance_vox_);
  const VoxelBox grid = VoxelBox::of(grid_);
  for (const LiveBlock& of_part : part.blocks) {
    const Index3 first = fusion::kBlockEdge * of_part.block;
    for (std::int32_t z = 0; z < 8; ++z) {
      for (std::uint64_t bits = of_part.bits[static_cast<std::size_t>(z)]; bits != 0; bits &= bits - 1) {
        const std::int32_t bit = std::countr_zero(bits);
        const VoxelBox near =
            VoxelBox{first + Index3{bit & 7, bit >> 3, z}, {1, 1, 1}}.grown(margin).intersection(grid);
        for (std::int32_t nz = near.min.z; nz < near.end().z; ++nz)
          for (std::int32_t ny = near.min.y; ny < near.end().y; ++ny)
            masked_.set_run(ny, nz, near.min.x, near.end().x);
      }
    }
    blocks_near(of_part.block, margin).intersection(blocks_).for_each([&](Index3 block) { touch(block); });
  }
}

/// Makes all masks anew, of what a person has decided about now.
void LiveMatter::renew_masks() {
  std::ranges::fill(masked_.words(), 0);
  blocks_.for_each([&](Index3 block) {
    if (is_seen_[blocks_.index(block)] != 0) touch(block);
  });
  for (const auto& [id, object] : objects_.all())
    if (object.is_fixed()) mask(object.part);
}

/// Returns whether cameras see something where a part is masked.
bool LiveMatter::is_seen_at(const LivePart& part) const {
  bool any = false;
  for (const LiveBlock& of_part : part.blocks) {
    blocks_near(of_part.block, std::max(1, tolerance_vox_)).intersection(blocks_).for_each([&](Index3 block) {
      const Index3 first = fusion::kBlockEdge * block;
      for_rows(grid_, block, [&](std::int32_t y, std::int32_t z) {
        any = any || (row_of(seen_, first, y, z) & row_of(masked_, first, y, z)) != 0;
      });
    });
  }
  return any;
}

void LiveMatter::look_at_discarded(core::Nanoseconds now_ns) {
  for (const auto& [id, object] : objects_.all())
    if (object.standing == LiveStanding::kDiscarded && is_seen_at(object.part))
      objects_.see_discarded(id, now_ns);
}

bool LiveMatter::expires() const {
  return std::ranges::any_of(objects_.all(), [](const auto& entry) { return !entry.second.is_there(); });
}

core::Status LiveMatter::freeze(std::uint16_t id) {
  const core::Status frozen = objects_.freeze(id);
  if (frozen) mask(objects_.all().at(id).part);
  decided_ = decided_ || frozen;
  return frozen;
}

core::Status LiveMatter::discard(std::uint16_t id, core::Nanoseconds now_ns) {
  const core::Status discarded = objects_.discard(id, now_ns);
  if (discarded) mask(objects_.all().at(id).part);
  decided_ = decided_ || discarded;
  return discarded;
}

core::Status LiveMatter::restore(std::uint16_t id, core::Nanoseconds now_ns) {
  const core::Status restored = objects_.restore(id, now_ns);
  if (restored) renew_masks();
  decided_ = decided_ || restored;
  return restored;
}

/// Brings the layers of an id to those of a part. Returns them if they differ.
std::optional<layers::ComputedObject> LiveMatter::show(std::uint16_t id, const LivePart& part) {
  auto shown = shown_.find(id);
  if (shown == shown_.end()) {
    if (part.voxels == 0) return std::nullopt;
    // create() has made such layers.
    shown = shown_.emplace(id, Shown{fusion::IncrementalLayers::create(grid_, profile_).value(), {}}).first;
  }
  const std::vector<Index3> changed = differing_blocks(shown->second.part, part);
  if (changed.empty()) return std::nullopt;
  const auto write = [&](bool set) {
    for (const LiveBlock& of_part : part.blocks) {
      const Index3 first = fusion::kBlockEdge * of_part.block;
      for_rows(grid_, of_part.block, [&](std::int32_t y, std::int32_t z) {
        const std::uint64_t bits = of_part.bits[static_cast<std::size_t>(z - first.z)] >> (8 * (y - first.y));
        set_row(scratch_, first, y, z, set ? static_cast<std::uint8_t>(bits & 0xFF) : 0);
      });
    }
  };
  write(true);
  const fusion::LayersChange& change = shown->second.layers.update(scratch_, changed);
  write(false);
  shown->second.part = part;
  layers::ComputedObject computed{id, shown->second.layers.bricks(), profile_, change.changed};
  computed.touched.insert(computed.touched.end(), change.removed.begin(), change.removed.end());
  return computed;
}

std::vector<layers::ComputedObject> LiveMatter::update(core::Nanoseconds now_ns) {
  look_at_discarded(now_ns);
  if (objects_.expire(now_ns)) renew_masks();
  bool differs = decided_;
  decided_ = false;
  for (const Index3 block : touched_) {
    is_touched_[blocks_.index(block)] = 0;
    differs = renew(block) || differs;
  }
  touched_.clear();
  if (!differs) return {};
  rest_ = objects_.follow(large_parts(), now_ns);
  std::vector<layers::ComputedObject> changed;
  for (std::uint16_t id = messages::kFirstLiveObjectId; id <= kLiveId; ++id) {
    const auto object = objects_.all().find(id);
    const bool is_there = object != objects_.all().end() && object->second.is_there();
    if (auto computed = show(id, id == kLiveId ? rest_ : is_there ? object->second.part : LivePart{}))
      changed.push_back(*std::move(computed));
  }
  return changed;
}

std::size_t LiveMatter::voxels() const {
  std::size_t count = 0;
  for (const auto& [id, shown] : shown_) count += shown.part.voxels;
  return count;
}

std::optional<Eigen::Vector3d> LiveMatter::middle_m(std::uint16_t id) const {
  const auto shown = shown_.find(id);
  if (shown == shown_.end() || shown->second.part.voxels == 0) return std::nullopt;
  return grid_.origin_m + grid_.voxel_size_m.sides_m().cwiseProduct(shown->second.part.middle_vox());
}

}  // namespace phantom::wva_server
