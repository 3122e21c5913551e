#include "components/wva_server/live/live_part.hpp"

#include <algorithm>
#include <bit>

#include "common/fusion/fused_block.hpp"

namespace phantom::wva_server {
namespace {

using workspace::Index3;

/// Calls `each` with the blocks of two parts that stand at one place; null: it has none there.
template <class Each>
void for_places(const LivePart& a, const LivePart& b, Each each) {
  auto of_a = a.blocks.begin(), of_b = b.blocks.begin();
  while (of_a != a.blocks.end() || of_b != b.blocks.end()) {
    const bool only_a = of_b == b.blocks.end() || (of_a != a.blocks.end() && of_a->block < of_b->block);
    const bool only_b = of_a == a.blocks.end() || (of_b != b.blocks.end() && of_b->block < of_a->block);
    each(only_b ? nullptr : &*of_a, only_a ? nullptr : &*of_b);
    if (!only_b) ++of_a;
    if (!only_a) ++of_b;
  }
}

}  // namespace

LivePart part_of(std::span<const Index3> voxels) {
  std::vector<std::pair<Index3, Index3>> by_block;  // block, voxel
  by_block.reserve(voxels.size());
  LivePart part;
  for (const Index3 v : voxels) {
    by_block.emplace_back(fusion::block_of(v), v);
    part.sum_vox += workspace::vector(v);
  }
  part.voxels = voxels.size();
  std::sort(by_block.begin(), by_block.end());
  for (const auto& [block, v] : by_block) {
    if (part.blocks.empty() || part.blocks.back().block != block) part.blocks.push_back({block, {}});
    const Index3 in = v - fusion::kBlockEdge * block;
    part.blocks.back().bits[static_cast<std::size_t>(in.z)] |= std::uint64_t{1} << (8 * in.y + in.x);
  }
  return part;
}

void unite(LivePart& part, const LivePart& other) {
  std::vector<LiveBlock> blocks;
  blocks.reserve(part.blocks.size() + other.blocks.size());
  for_places(part, other, [&](const LiveBlock* mine, const LiveBlock* others) {
    blocks.push_back(mine != nullptr ? *mine : *others);
    for (std::size_t z = 0; mine != nullptr && others != nullptr && z < 8; ++z)
      blocks.back().bits[z] |= others->bits[z];
  });
  part.blocks = std::move(blocks);
  part.voxels += other.voxels;
  part.sum_vox += other.sum_vox;
}

std::size_t shared_voxels(const LivePart& a, const LivePart& b) {
  std::size_t count = 0;
  for_places(a, b, [&](const LiveBlock* of_a, const LiveBlock* of_b) {
    for (std::size_t z = 0; of_a != nullptr && of_b != nullptr && z < 8; ++z)
      count += static_cast<std::size_t>(std::popcount(of_a->bits[z] & of_b->bits[z]));
  });
  return count;
}

std::vector<Index3> differing_blocks(const LivePart& a, const LivePart& b) {
  std::vector<Index3> blocks;
  for_places(a, b, [&](const LiveBlock* of_a, const LiveBlock* of_b) {
    if (of_a != nullptr && of_b != nullptr && of_a->bits == of_b->bits) return;
    blocks.push_back(of_a != nullptr ? of_a->block : of_b->block);
  });
  return blocks;
}

}  // namespace phantom::wva_server
