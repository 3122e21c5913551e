#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/workspace/grid.hpp"
#include "common/workspace/large_pages.hpp"
#include "common/workspace/voxel_box.hpp"

namespace phantom::fusion {

/// A block, the unit of fusion, is a cube of 8³ voxels. Voxels are stored x fastest, then y, z.
inline constexpr std::int32_t kBlockEdge = 8;
inline constexpr std::size_t kBlockVoxels = 512;
/// Stored distances are in steps of this part of a voxel.
inline constexpr double kDistanceSteps = 1024.0;

/// One bit for each voxel of a block: word z, bit 8 y + x.
using BlockBits = std::array<std::uint64_t, 8>;
constexpr std::uint64_t bit_of(std::int32_t x, std::int32_t y) { return std::uint64_t{1} << (8 * y + x); }

/// Returns the number of the block, along one axis, in which a voxel lies.
constexpr std::int32_t block_along(std::int32_t voxel) { return voxel >> 3; }
constexpr workspace::Index3 block_of(workspace::Index3 v) {
  return {block_along(v.x), block_along(v.y), block_along(v.z)};
}
/// Returns the box of a grid's blocks.
inline workspace::VoxelBox blocks_of(const workspace::GridSpec& grid) {
  const workspace::Index3 last{grid.size_vox[0] - 1, grid.size_vox[1] - 1, grid.size_vox[2] - 1};
  return workspace::VoxelBox::between({0, 0, 0}, block_of(last) + workspace::Index3{1, 1, 1});
}
/// Returns the box of a block's voxels. The last blocks may reach beyond the grid.
constexpr workspace::VoxelBox voxels_of(workspace::Index3 block) {
  return {kBlockEdge * block, {kBlockEdge, kBlockEdge, kBlockEdge}};
}

/// What was measured in a block, and what the change gate keeps of its voxels.
struct FusedBlock {
  alignas(64) std::array<std::int16_t, kBlockVoxels> distance;  ///< to the surface along the line of sight,
                                                                ///< in 1/1024 voxel; negative: behind it
  alignas(64) std::array<std::uint8_t, kBlockVoxels> weight;    ///< frames that count; 0: unknown
  BlockBits published;                                          ///< voxels published as occupied
  BlockBits once;      ///< the last measurement disagreed with what is published
  BlockBits twice;     ///< the last two did
  BlockBits appears;   ///< free voxels that this frame's votes publish as occupied
  BlockBits vanishes;  ///< occupied voxels that they withdraw
  workspace::Index3 place;
  std::uint8_t fused_count = 0;  ///< times that it was fused, as far as Fusion counts
  bool used = false;
};

/// All blocks of a grid: a directory of the whole grid, and a fixed number of blocks with content. Allocates
/// in the constructor only.
class BlockPool {
 public:
  BlockPool(const workspace::GridSpec& grid, std::size_t max_blocks);

  static constexpr std::int32_t kNoSlot = -1;

  /// The blocks of the grid; place of each in the directory: box().index(block).
  const workspace::VoxelBox& box() const noexcept { return box_; }
  std::span<const std::int32_t> directory() const noexcept { return directory_; }
  /// Returns the content of a block of the grid, or null.
  FusedBlock* find(workspace::Index3 block) noexcept { return at(box_.index(block)); }
  const FusedBlock* find(workspace::Index3 block) const noexcept {
    return const_cast<BlockPool*>(this)->find(block);  // NOLINT: the same look-up
  }
  FusedBlock* at(std::size_t place) noexcept {
    return directory_[place] == kNoSlot ? nullptr : &slots_[static_cast<std::size_t>(directory_[place])];
  }
  /// Gives a block an empty content. Returns null if no slot is free. Real-time safe: yes.
  FusedBlock* allocate(std::size_t place) noexcept;
  void release(FusedBlock& block) noexcept;

  /// All slots; those in use say so.
  std::span<FusedBlock> slots() noexcept { return slots_; }
  std::size_t in_use() const noexcept { return slots_.size() - free_.size(); }
  std::size_t bytes() const noexcept {
    return slots_.size() * sizeof(FusedBlock) + (free_.capacity() + directory_.size()) * sizeof(std::int32_t);
  }
  workspace::Index3 block_at(std::size_t place) const noexcept;

 private:
  workspace::VoxelBox box_;
  std::vector<std::int32_t> directory_;
  workspace::LargeVector<FusedBlock> slots_;
  std::vector<std::int32_t> free_;
};

}  // namespace phantom::fusion
