#include "common/fusion/fused_block.hpp"

namespace phantom::fusion {

BlockPool::BlockPool(const workspace::GridSpec& grid, std::size_t max_blocks) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    box_.size[axis] = (grid.size_vox[axis] + kBlockEdge - 1) / kBlockEdge;
  directory_.assign(box_.voxel_count(), kNoSlot);
  slots_.resize(max_blocks, FusedBlock{});  // writes all: no page is touched for the first time later
  free_.reserve(max_blocks);
  for (std::size_t i = max_blocks; i-- > 0;) free_.push_back(static_cast<std::int32_t>(i));
}

workspace::Index3 BlockPool::block_at(std::size_t place) const noexcept {
  const auto index = static_cast<std::int64_t>(place), nx = std::int64_t{box_.size[0]},
             ny = std::int64_t{box_.size[1]};
  return {static_cast<std::int32_t>(index % nx), static_cast<std::int32_t>(index / nx % ny),
          static_cast<std::int32_t>(index / (nx * ny))};
}

FusedBlock* BlockPool::allocate(std::size_t place) noexcept {
  if (free_.empty()) return nullptr;
  const std::int32_t slot = free_.back();
  free_.pop_back();
  directory_[place] = slot;
  FusedBlock& block = slots_[static_cast<std::size_t>(slot)];
  block.distance.fill(0);
  block.weight.fill(0);
  block.published = block.once = block.twice = block.appears = block.vanishes = {};
  block.place = block_at(place);
  block.fused_count = 0;
  block.used = true;
  return &block;
}

void BlockPool::release(FusedBlock& block) noexcept {
  block.used = false;
  directory_[box_.index(block.place)] = kNoSlot;
  free_.push_back(static_cast<std::int32_t>(&block - slots_.data()));
}

}  // namespace phantom::fusion
