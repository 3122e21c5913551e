#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "common/workspace/grid.hpp"

namespace phantom::wva_server {

/// Voxels of a block of 8×8×8: word z, bit 8·y + x.
struct LiveBlock {
  workspace::Index3 block;
  std::array<std::uint64_t, 8> bits{};
};

/// Voxels that belong together, by their blocks: in rising order, each once, none without a voxel.
struct LivePart {
  std::vector<LiveBlock> blocks;
  std::size_t voxels = 0;
  Eigen::Vector3d sum_vox = Eigen::Vector3d::Zero();  ///< of the voxels' indices

  /// Returns the middle of the voxels' middles, from the grid's corner. There must be one.
  Eigen::Vector3d middle_vox() const {
    return sum_vox / static_cast<double>(voxels) + Eigen::Vector3d::Constant(0.5);
  }
};

/// Returns the part of these voxels, each of which must be there once.
LivePart part_of(std::span<const workspace::Index3> voxels);
/// Adds the voxels of another part, which must be none of `part`'s.
void unite(LivePart& part, const LivePart& other);
/// Returns whether a voxel of one is within so many voxels, along each axis, of one of the other.
bool are_near(const LivePart& a, const LivePart& b, int reach_vox);
/// Returns the parts with those put together that are near one another, or near one that is, in the order of
/// the first of each.
std::vector<LivePart> joined(std::vector<LivePart> parts, int reach_vox);
/// Returns how many voxels are in both.
std::size_t shared_voxels(const LivePart& a, const LivePart& b);
/// Returns the blocks in which they differ.
std::vector<workspace::Index3> differing_blocks(const LivePart& a, const LivePart& b);

}  // namespace phantom::wva_server
