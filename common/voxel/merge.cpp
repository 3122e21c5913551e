#include "common/voxel/merge.hpp"

#include <algorithm>

namespace phantom::voxel {
namespace {

/// The strongest first: what a later one claims must be free, or of a higher μ and the same rank.
std::vector<MergeEntry> by_strength(MergeLaw law, std::span<const MergeEntry> entries) {
  std::vector<MergeEntry> sorted(entries.begin(), entries.end());
  if (law == MergeLaw::kHighestViscosity) {
    for (MergeEntry& entry : sorted) entry.rank = 0;
  }
  std::sort(sorted.begin(), sorted.end(), [](const MergeEntry& a, const MergeEntry& b) {
    return a.rank != b.rank ? a.rank > b.rank : a.id < b.id;
  });
  return sorted;
}

/// One object's claim on one brick.
struct Claim {
  const std::int8_t* orders;
  const MergeEntry* entry;
};

void put(const Claim& claim, bool first_of_rank, const Workspace::MutableBrick& brick,
         std::array<std::uint8_t, kBrickVoxels>& settled) {
  if (first_of_rank) std::copy_n(brick.mu_code, kBrickVoxels, settled.begin());
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    const std::uint8_t code = (*claim.entry->codes)[static_cast<std::uint8_t>(claim.orders[i])];
    if (settled[i] != 0 || code <= brick.mu_code[i]) continue;
    brick.mu_code[i] = code;
    brick.order[i] = claim.orders[i];
    brick.object[i] = claim.entry->id;
  }
}

}  // namespace

std::vector<BrickKey> keys_of(std::span<const MergeEntry> entries) {
  std::vector<BrickKey> keys;
  for (const MergeEntry& entry : entries) keys.insert(keys.end(), entry.bricks->keys().begin(), entry.bricks->keys().end());
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

void merge_bricks(MergeLaw law, std::span<const MergeEntry> entries, std::span<const BrickKey> keys, Workspace& workspace,
                  int /*threads*/) {
  const std::vector<MergeEntry> strongest_first = by_strength(law, entries);
  std::vector<Claim> claims;
  std::array<std::uint8_t, kBrickVoxels> settled{};
  for (const BrickKey key : keys) {
    claims.clear();
    for (const MergeEntry& entry : strongest_first) {
      if (const std::int8_t* orders = entry.bricks->orders(key)) claims.push_back({orders, &entry});
    }
    workspace.remove_brick(key);
    if (claims.empty()) continue;
    const Workspace::MutableBrick brick = workspace.make_brick(key);
    for (std::size_t i = 0; i < claims.size(); ++i) {
      put(claims[i], i == 0 || claims[i].entry->rank != claims[i - 1].entry->rank, brick, settled);
    }
  }
}

}  // namespace phantom::voxel
