#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/fusion/fuse_kernel.hpp"
#include "common/fusion/fused_block.hpp"
#include "common/workspace/voxel_box.hpp"

namespace phantom::fusion {

/// In how many frames that see a voxel in succession it must be occupied before it is published, and free
/// before it is withdrawn.
inline constexpr int kFramesToAppear = 2, kFramesToVanish = 3;
/// Smaller changes are published when it is their brick's turn: once in so many frames.
inline constexpr std::uint32_t kSmallChangeTurns = 64;
/// In so many bricks of a frame at most; others wait for their next turn.
inline constexpr std::size_t kSmallChangeBricks = 4;
/// Greatest size of a component that may count as speckle.
inline constexpr int kMaxSpeckle_vox = 64;

/// The published occupancy of a grid, which changes only where its geometry does. Each frame votes on the
/// voxels that it sees; settle() then publishes what enough frames agree on. Allocates in the constructor
/// only.
///
/// Components are connected through 26 neighbours. A change of fewer than `min_component_vox` voxels that are
/// connected waits for its brick's turn. So a still scene, whatever its noise, changes each brick once in
/// kSmallChangeTurns frames at most, and kSmallChangeBricks bricks a frame. Matter in components of fewer
/// voxels is speckle and is not published.
class ChangeGate {
 public:
  ChangeGate(const workspace::GridSpec& grid, BlockPool& pool, int min_component_vox);

  /// One bit for each voxel of the grid.
  const workspace::BitVolume& published() const noexcept { return published_; }
  /// The blocks with a change since clear_changes(), each once.
  std::span<const workspace::Index3> changed_blocks() const noexcept { return changed_; }
  void clear_changes() noexcept;

  /// Counts a frame's votes. `keeps_behind`: voxels behind the shell stay as they are.
  void vote(FusedBlock& block, const detail::BlockVotes& votes, bool keeps_behind) noexcept;

  struct Settled {
    std::size_t appeared = 0, vanished = 0;  ///< voxels
    std::size_t speckle = 0;                 ///< voxels of matter held back or cleared: too small a component
    std::size_t waiting = 0;                 ///< voxels of changes that wait for their brick's turn
  };
  /// Publishes what the votes since the last call decided.
  Settled settle() noexcept;

  /// Publishes all of a block's voxels in the grid as occupied, or as free, at once. Returns how many
  /// changed.
  std::size_t set_block(workspace::Index3 block, bool occupied) noexcept;
  /// Returns what is published of a block.
  BlockBits bits_of(workspace::Index3 block) const noexcept;
  std::size_t bytes() const noexcept;

 private:
  std::size_t enough() const noexcept { return static_cast<std::size_t>(min_component_vox_); }
  BlockBits in_grid(workspace::Index3 block) const noexcept;
  void flip(workspace::Index3 v) noexcept;
  void flip(workspace::Index3 block, const BlockBits& bits) noexcept;
  void mark_changed(workspace::Index3 block) noexcept;
  bool is_small(const workspace::BitVolume& bits, workspace::Index3 v) const noexcept;
  bool is_small(const workspace::BitVolume& bits, const BlockBits& part, workspace::Index3 v) const noexcept;
  void set_candidates() noexcept;
  void clear_candidates() noexcept;
  bool is_open(const FusedBlock& block) noexcept;
  void hold_small_changes(FusedBlock& block, Settled& settled) noexcept;
  void publish(FusedBlock& block) noexcept;
  void hold_speckle(FusedBlock& block, Settled& settled) noexcept;
  void clear_remains(workspace::Index3 v, Settled& settled) noexcept;

  workspace::GridSpec grid_;
  BlockPool& pool_;
  int min_component_vox_;
  workspace::BitVolume published_;
  workspace::BitVolume candidates_;  // voxels that would change, during settle()
  workspace::VoxelBox bricks_;       // of the grid
  std::uint32_t turn_ = 0;
  std::array<std::size_t, kSmallChangeBricks> bricks_open_{};  // bricks of this frame with small changes
  std::size_t open_count_ = 0;
  std::vector<std::uint8_t> is_changed_;
  std::vector<workspace::Index3> changed_;
  std::vector<FusedBlock*> pending_;
};

}  // namespace phantom::fusion
