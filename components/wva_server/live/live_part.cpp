#include "components/wva_server/live/live_part.hpp"

#include <algorithm>
#include <bit>
#include <numeric>

#include "common/fusion/fused_block.hpp"
#include "common/workspace/voxel_box.hpp"

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

/// The blocks of a part; it must have one.
workspace::VoxelBox blocks_around(const LivePart& part) {
  Index3 low = part.blocks.front().block, high = low;
  for (const LiveBlock& one : part.blocks) {
    low = workspace::min(low, one.block);
    high = workspace::max(high, one.block);
  }
  return workspace::VoxelBox::between(low, high + Index3{1, 1, 1});
}

/// Bits from..to (0 to 7, within the block) along x in rows from..to along y.
std::uint64_t rows(std::int32_t x0, std::int32_t x1, std::int32_t y0, std::int32_t y1) {
  const std::uint64_t row = (0xFFULL >> (7 - (x1 - x0))) << x0;
  std::uint64_t bits = 0;
  for (std::int32_t y = y0; y <= y1; ++y) bits |= row << (8 * y);
  return bits;
}

/// Returns whether the part has a voxel in a box.
bool has_any(const LivePart& part, const workspace::VoxelBox& box) {
  const Index3 last = box.end() - Index3{1, 1, 1};
  bool any = false;
  workspace::VoxelBox::between(fusion::block_of(box.min), fusion::block_of(last) + Index3{1, 1, 1})
      .for_each([&](Index3 block) {
        const auto found = std::ranges::lower_bound(part.blocks, block, {}, &LiveBlock::block);
        if (any || found == part.blocks.end() || found->block != block) return;
        const Index3 first = fusion::kBlockEdge * block;
        const Index3 low = workspace::max(box.min - first, {0, 0, 0}),
                     high = workspace::min(last - first, {7, 7, 7});
        const std::uint64_t mask = rows(low.x, high.x, low.y, high.y);
        for (std::int32_t z = low.z; z <= high.z; ++z)
          any = any || (found->bits[static_cast<std::size_t>(z)] & mask) != 0;
      });
  return any;
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

bool are_near(const LivePart& a, const LivePart& b, int reach_vox) {
  if (a.voxels == 0 || b.voxels == 0) return false;
  if (b.voxels < a.voxels) return are_near(b, a, reach_vox);
  const std::int32_t reach_blocks = (reach_vox + fusion::kBlockEdge - 1) / fusion::kBlockEdge;
  const workspace::VoxelBox near_b = blocks_around(b).grown(reach_blocks);
  return std::ranges::any_of(a.blocks, [&](const LiveBlock& of_a) {
    if (!near_b.contains(of_a.block)) return false;
    const Index3 first = fusion::kBlockEdge * of_a.block;
    for (std::int32_t z = 0; z < 8; ++z) {
      for (std::uint64_t bits = of_a.bits[static_cast<std::size_t>(z)]; bits != 0; bits &= bits - 1) {
        const std::int32_t bit = std::countr_zero(bits);
        const workspace::VoxelBox voxel{first + Index3{bit & 7, bit >> 3, z}, {1, 1, 1}};
        if (has_any(b, voxel.grown(reach_vox))) return true;
      }
    }
    return false;
  });
}

std::vector<LivePart> joined(std::vector<LivePart> parts, int reach_vox) {
  std::vector<std::size_t> group(parts.size());
  std::iota(group.begin(), group.end(), std::size_t{0});
  for (std::size_t i = 0; i < parts.size(); ++i) {
    for (std::size_t j = i + 1; j < parts.size(); ++j) {
      if (group[i] == group[j] || !are_near(parts[i], parts[j], reach_vox)) continue;
      const auto [to, from] = std::minmax(group[i], group[j]);
      std::ranges::replace(group, std::size_t{from}, std::size_t{to});
    }
  }
  std::vector<LivePart> all;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (group[i] == i) {
      group[i] = all.size();
      all.push_back(std::move(parts[i]));
    } else {
      group[i] = group[group[i]];
      unite(all[group[i]], parts[i]);
    }
  }
  return all;
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
