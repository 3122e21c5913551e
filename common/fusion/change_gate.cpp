#include "common/fusion/change_gate.hpp"

#include <algorithm>
#include <array>
#include <bit>

#include "common/workspace/workspace.hpp"

namespace phantom::fusion {
namespace {

using workspace::Index3;

/// Calls visit(voxel) for each bit of a block.
template <class Visit>
void for_each_voxel(Index3 block, const BlockBits& bits, const Visit& visit) {
  for (std::int32_t z = 0; z < kBlockEdge; ++z) {
    for (std::uint64_t word = bits[static_cast<std::size_t>(z)]; word != 0; word &= word - 1) {
      const int bit = std::countr_zero(word);
      visit(kBlockEdge * block + Index3{bit % 8, bit / 8, z});
    }
  }
}

std::size_t count_of(const BlockBits& bits) {
  std::size_t count = 0;
  for (const std::uint64_t word : bits) count += static_cast<std::size_t>(std::popcount(word));
  return count;
}

bool any(const BlockBits& bits) {
  return std::any_of(bits.begin(), bits.end(), [](std::uint64_t word) { return word != 0; });
}

/// Returns the voxels of `bits` that are, or are neighbours of, those of `from`, which are of `bits`.
BlockBits grown(const BlockBits& from, const BlockBits& bits) {
  constexpr std::uint64_t kNotFirst = 0xFEFEFEFEFEFEFEFE, kNotLast = 0x7F7F7F7F7F7F7F7F;  // of each row
  BlockBits flat, next;
  for (std::size_t z = 0; z < flat.size(); ++z) {
    const std::uint64_t rows = from[z] | (from[z] << 1 & kNotFirst) | (from[z] >> 1 & kNotLast);
    flat[z] = rows | rows << 8 | rows >> 8;
  }
  for (std::size_t z = 0; z < flat.size(); ++z)
    next[z] = bits[z] & (flat[z] | (z > 0 ? flat[z - 1] : 0) | (z + 1 < flat.size() ? flat[z + 1] : 0));
  return next;
}

/// Calls visit(part, voxel) for each part of a block that is connected within the block, and one of its
/// voxels.
template <class Visit>
void for_each_part(Index3 block, const BlockBits& bits, const Visit& visit) {
  BlockBits left = bits;
  for (std::size_t z = 0; z < left.size(); ++z) {
    while (left[z] != 0) {
      BlockBits part{}, next{};
      next[z] = left[z] & -left[z];
      const int bit = std::countr_zero(left[z]);
      while (next != part) {
        part = next;
        next = grown(part, bits);
      }
      for (std::size_t i = 0; i < part.size(); ++i) left[i] &= ~part[i];
      visit(part, kBlockEdge * block + Index3{bit % 8, bit / 8, static_cast<std::int32_t>(z)});
    }
  }
}

/// Returns the bits of a row at x − 1, x and x + 1; voxels beyond the row are 0.
unsigned three_bits(const std::uint64_t* row, std::int32_t x, std::int32_t length) {
  const std::int32_t in_word = x & 63;
  const std::uint64_t* const word = row + (x >> 6);
  if (in_word == 0) return static_cast<unsigned>((*word << 1 & 6) | (x > 0 ? word[-1] >> 63 : 0));
  const std::uint64_t low = *word >> (in_word - 1) & 7;
  return static_cast<unsigned>(in_word == 63 && x + 1 < length ? low | (word[1] & 1) << 2 : low);
}

/// Counts the bits among the 27 around a voxel: all of one component, if the voxel's is set.
int count_around(const workspace::BitVolume& bits, Index3 v) {
  constexpr std::uint32_t kOnes = 0x32212110;  // bits that are set in 0…7, four bits each
  const auto& size = bits.size();
  std::uint32_t count = 0;
  for (std::int32_t z = std::max(0, v.z - 1); z <= std::min(size[2] - 1, v.z + 1); ++z) {
    for (std::int32_t y = std::max(0, v.y - 1); y <= std::min(size[1] - 1, v.y + 1); ++y)
      count += kOnes >> (4 * three_bits(bits.row(y, z), v.x, size[0])) & 15;
  }
  return static_cast<int>(count);
}

/// Calls visit(voxel) for each bit among the 27 around a voxel.
template <class Visit>
void for_each_around(const workspace::BitVolume& bits, Index3 v, const Visit& visit) {
  const auto& size = bits.size();
  for (std::int32_t z = std::max(0, v.z - 1); z <= std::min(size[2] - 1, v.z + 1); ++z) {
    for (std::int32_t y = std::max(0, v.y - 1); y <= std::min(size[1] - 1, v.y + 1); ++y) {
      const unsigned three = three_bits(bits.row(y, z), v.x, size[0]);
      for (std::int32_t i = 0; i < 3; ++i) {
        if ((three >> i & 1) != 0) visit(Index3{v.x + i - 1, y, z});
      }
    }
  }
}

}  // namespace

ChangeGate::ChangeGate(const workspace::GridSpec& grid, BlockPool& pool, int min_component_vox)
    : grid_(grid),
      pool_(pool),
      min_component_vox_(min_component_vox),
      published_(grid.size_vox),
      candidates_(grid.size_vox),
      bricks_(workspace::bricks_of(workspace::VoxelBox::of(grid))),
      is_changed_(pool.box().voxel_count()) {
  changed_.reserve(is_changed_.size());
  pending_.reserve(pool.slots().size());
}

void ChangeGate::clear_changes() noexcept {
  for (const Index3 block : changed_) is_changed_[pool_.box().index(block)] = 0;
  changed_.clear();
}

void ChangeGate::mark_changed(Index3 block) noexcept {
  std::uint8_t& marked = is_changed_[pool_.box().index(block)];
  if (marked != 0) return;
  marked = 1;
  changed_.push_back(block);
}

BlockBits ChangeGate::in_grid(Index3 block) const noexcept {
  BlockBits bits{};
  const Index3 first = kBlockEdge * block;
  const auto left = [&](std::size_t axis) {
    return std::clamp(grid_.size_vox[axis] - first[axis], 0, kBlockEdge);
  };
  const std::uint64_t row = (std::uint64_t{1} << left(0)) - 1;
  std::uint64_t slice = 0;
  for (std::int32_t y = 0; y < left(1); ++y) slice |= row << (8 * y);
  std::fill_n(bits.begin(), left(2), slice);
  return bits;
}

void ChangeGate::vote(FusedBlock& block, const detail::BlockVotes& votes, bool keeps_behind) noexcept {
  const BlockBits there = in_grid(block.place);
  std::uint64_t any_pending = 0;
  for (std::size_t z = 0; z < block.published.size(); ++z) {
    const std::uint64_t seen = votes.observed[z] & there[z], published = block.published[z],
                        free = votes.in_front[z] | (keeps_behind ? 0 : votes.behind[z]);
    const std::uint64_t disagrees = seen & ((published & free) | (~published & votes.occupied[z]));
    block.appears[z] = disagrees & ~published & block.once[z];
    block.vanishes[z] = disagrees & published & block.twice[z];
    block.twice[z] = (disagrees & block.once[z]) | (~seen & block.twice[z]);
    block.once[z] = disagrees | (~seen & block.once[z]);
    any_pending |= block.appears[z] | block.vanishes[z];
  }
  if (any_pending != 0) pending_.push_back(&block);
}

void ChangeGate::flip(Index3 v) noexcept {
  published_.flip(v.x, v.y, v.z);
  const Index3 block = block_of(v);
  if (FusedBlock* const fused = pool_.find(block))
    fused->published[static_cast<std::size_t>(v.z & 7)] ^= bit_of(v.x & 7, v.y & 7);
}

void ChangeGate::flip(Index3 block, const BlockBits& bits) noexcept {
  const Index3 first = kBlockEdge * block;
  for (std::int32_t z = 0; z < kBlockEdge; ++z) {
    std::uint64_t word = bits[static_cast<std::size_t>(z)];
    for (std::int32_t y = 0; word != 0; ++y, word >>= 8) {
      if ((word & 255) != 0)
        published_.row(first.y + y, first.z + z)[first.x >> 6] ^= (word & 255) << (first.x & 63);
    }
  }
  if (FusedBlock* const fused = pool_.find(block)) {
    for (std::size_t z = 0; z < bits.size(); ++z) fused->published[z] ^= bits[z];
  }
}

bool ChangeGate::is_small(const workspace::BitVolume& bits, Index3 v) const noexcept {
  if (count_around(bits, v) >= min_component_vox_) return false;
  std::array<Index3, kMaxSpeckle_vox> found;
  std::size_t count = 1;
  found[0] = v;
  const auto is_found = [&](Index3 n) {
    const auto end = found.begin() + static_cast<std::ptrdiff_t>(count);
    return std::find(found.begin(), end, n) != end;
  };
  for (std::size_t i = 0; i < count && count < enough(); ++i) {
    for_each_around(bits, found[i], [&](Index3 n) {
      if (count < enough() && !is_found(n)) found[count++] = n;
    });
  }
  return count < enough();
}

/// The same of a voxel's part of a block: what is large within its block is so with its neighbours, too.
bool ChangeGate::is_small(const workspace::BitVolume& bits, const BlockBits& part, Index3 v) const noexcept {
  return count_of(part) < enough() && is_small(bits, v);
}

/// Sets the voxels that would change in the volume of candidates.
void ChangeGate::set_candidates() noexcept {
  for (const FusedBlock* const block : pending_) {
    const Index3 first = kBlockEdge * block->place;
    for (std::int32_t z = 0; z < kBlockEdge; ++z) {
      const auto slice = static_cast<std::size_t>(z);
      std::uint64_t word = block->appears[slice] | block->vanishes[slice];
      for (std::int32_t y = 0; word != 0; ++y, word >>= 8) {
        if ((word & 255) != 0)
          candidates_.row(first.y + y, first.z + z)[first.x >> 6] |= (word & 255) << (first.x & 63);
      }
    }
  }
}

void ChangeGate::clear_candidates() noexcept {
  for (const FusedBlock* const block : pending_) {
    const Index3 first = kBlockEdge * block->place;
    for (std::int32_t z = first.z; z < std::min(first.z + kBlockEdge, grid_.size_vox[2]); ++z) {
      for (std::int32_t y = first.y; y < std::min(first.y + kBlockEdge, grid_.size_vox[1]); ++y)
        candidates_.row(y, z)[first.x >> 6] = 0;  // its neighbours are cleared, too, or have none
    }
  }
}

/// Returns whether a block's brick may publish small changes in this frame.
bool ChangeGate::is_open(const FusedBlock& block) noexcept {
  const std::size_t brick = bricks_.index(workspace::brick_of(kBlockEdge * block.place));
  if ((brick + turn_) % kSmallChangeTurns != 0) return false;
  const auto end = bricks_open_.begin() + static_cast<std::ptrdiff_t>(open_count_);
  if (std::find(bricks_open_.begin(), end, brick) != end) return true;
  if (open_count_ == bricks_open_.size()) return false;
  bricks_open_[open_count_++] = brick;
  return true;
}

/// Takes small changes back if it is not their brick's turn. They stay disagreements, and are tried again.
void ChangeGate::hold_small_changes(FusedBlock& block, Settled& settled) noexcept {
  BlockBits change, small{};
  for (std::size_t z = 0; z < change.size(); ++z) change[z] = block.appears[z] | block.vanishes[z];
  for_each_part(block.place, change, [&](const BlockBits& part, Index3 v) {
    if (!is_small(candidates_, part, v)) return;
    for (std::size_t z = 0; z < small.size(); ++z) small[z] |= part[z];
  });
  if (!any(small) || is_open(block)) return;
  for (std::size_t z = 0; z < small.size(); ++z) {
    block.appears[z] &= ~small[z];
    block.vanishes[z] &= ~small[z];
  }
  settled.waiting += count_of(small);
}

void ChangeGate::publish(FusedBlock& block) noexcept {
  BlockBits change;
  for (std::size_t z = 0; z < change.size(); ++z) {
    change[z] = block.appears[z] | block.vanishes[z];
    block.once[z] &= ~change[z];
    block.twice[z] &= ~change[z];
  }
  flip(block.place, change);
}

/// Withdraws those of a block's new voxels that are speckle. They are tried again.
void ChangeGate::hold_speckle(FusedBlock& block, Settled& settled) noexcept {
  if (!any(block.appears)) return;
  BlockBits held{};
  for_each_part(block.place, block.published, [&](const BlockBits& part, Index3 v) {
    BlockBits fresh;
    for (std::size_t z = 0; z < held.size(); ++z) fresh[z] = part[z] & block.appears[z];
    if (!any(fresh) || !is_small(published_, part, v)) return;
    for (std::size_t z = 0; z < held.size(); ++z) held[z] |= fresh[z];
  });
  flip(block.place, held);
  for (std::size_t z = 0; z < held.size(); ++z) {
    block.appears[z] &= ~held[z];
    block.once[z] |= held[z];
  }
  settled.speckle += count_of(held);
  settled.appeared += count_of(block.appears);
  if (any(block.appears)) mark_changed(block.place);
}

/// Clears what a voxel that vanished left behind: neighbours in components that are too small now.
void ChangeGate::clear_remains(Index3 v, Settled& settled) noexcept {
  for_each_around(published_, v, [&](Index3 n) {
    if (!is_small(published_, n)) return;
    flip(n);
    mark_changed(block_of(n));
    ++settled.speckle;
  });
}

ChangeGate::Settled ChangeGate::settle() noexcept {
  Settled settled;
  ++turn_;
  open_count_ = 0;
  set_candidates();
  for (FusedBlock* const block : pending_) hold_small_changes(*block, settled);
  clear_candidates();
  for (FusedBlock* const block : pending_) publish(*block);
  for (FusedBlock* const block : pending_) hold_speckle(*block, settled);
  for (FusedBlock* const block : pending_) {
    if (!any(block->vanishes)) continue;
    mark_changed(block->place);
    settled.vanished += count_of(block->vanishes);
    for_each_voxel(block->place, block->vanishes, [&](Index3 v) { clear_remains(v, settled); });
  }
  pending_.clear();
  return settled;
}

std::size_t ChangeGate::set_block(Index3 block, bool occupied) noexcept {
  BlockBits change = bits_of(block);
  const BlockBits there = in_grid(block);
  for (std::size_t z = 0; z < change.size(); ++z) change[z] = occupied ? there[z] & ~change[z] : change[z];
  const std::size_t count = count_of(change);
  if (count == 0) return 0;
  flip(block, change);
  mark_changed(block);
  return count;
}

BlockBits ChangeGate::bits_of(Index3 block) const noexcept {
  BlockBits bits{};
  const Index3 first = kBlockEdge * block;
  for (std::int32_t z = 0; z < std::min(kBlockEdge, grid_.size_vox[2] - first.z); ++z) {
    for (std::int32_t y = 0; y < std::min(kBlockEdge, grid_.size_vox[1] - first.y); ++y)
      bits[static_cast<std::size_t>(z)] |=
          (published_.row(first.y + y, first.z + z)[first.x >> 6] >> (first.x & 63) & 255) << (8 * y);
  }
  return bits;
}

std::size_t ChangeGate::bytes() const noexcept {
  return 2 * published_.words().size() * sizeof(std::uint64_t) + is_changed_.size() +
         changed_.capacity() * sizeof(Index3) + pending_.capacity() * sizeof(FusedBlock*);
}

}  // namespace phantom::fusion
