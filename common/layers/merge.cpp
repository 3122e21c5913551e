#include "common/layers/merge.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <set>

#include "common/core/parallel.hpp"
#include "common/layers/merge_kernel.hpp"

namespace phantom::layers {
namespace {

/// Sorts by strength, the strongest first. A later entry gets only voxels that are free, or in which its μ is
/// higher at the same rank.
std::vector<MergeEntry> by_priority(MergeLaw law, std::span<const MergeEntry> entries) {
  std::vector<MergeEntry> sorted(entries.begin(), entries.end());
  if (law == MergeLaw::kHighestViscosity) {
    for (MergeEntry& entry : sorted) entry.rank = 0;
  }
  std::sort(sorted.begin(), sorted.end(), [](const MergeEntry& a, const MergeEntry& b) {
    return a.rank != b.rank ? a.rank > b.rank : a.id < b.id;
  });
  return sorted;
}

/// One object's merge_candidate on one brick.
struct Candidate {
  const std::int8_t* orders;
  const MergeEntry* entry;
};

/// The candidates on each brick: candidates[first[i]] … candidates[first[i + 1] − 1] are those on keys[i],
/// the strongest first.
struct Candidates {
  std::vector<Candidate> candidates;
  std::vector<std::size_t> first;

  std::span<const Candidate> on(std::size_t key) const {
    return {candidates.data() + first[key], first[key + 1] - first[key]};
  }
};

Candidates candidates_for(std::span<const workspace::BrickKey> keys,
                          const std::vector<MergeEntry>& strongest_first) {
  Candidates candidates;
  candidates.first.reserve(keys.size() + 1);
  for (const workspace::BrickKey key : keys) {
    candidates.first.push_back(candidates.candidates.size());
    for (const MergeEntry& entry : strongest_first) {
      if (const std::int8_t* orders = entry.bricks->orders(key))
        candidates.candidates.push_back({orders, &entry});
    }
  }
  candidates.first.push_back(candidates.candidates.size());
  return candidates;
}

/// Returns whether the brick is one object's interior and needs no memory of its own.
bool interior_alone(workspace::BrickKey key, std::span<const Candidate> candidates) {
  return candidates.size() == 1 && candidates[0].entry->bricks->is_interior(key);
}

/// Returns the greatest number of bricks with their own memory. All bricks inside one object share one.
std::size_t most_made(std::span<const workspace::BrickKey> keys, const Candidates& candidates) {
  std::size_t own = 0;
  std::set<std::uint16_t> filled;
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const std::span<const Candidate> on_it = candidates.on(i);
    if (interior_alone(keys[i], on_it)) {
      filled.insert(on_it[0].entry->id);
    } else if (!on_it.empty()) {
      ++own;
    }
  }
  return own + filled.size();
}

/// Where to merge a brick: all null if it is filled already; no labels if it shares those of its only object.
struct Target {
  std::uint8_t* mu_code = nullptr;
  std::int8_t* order = nullptr;
  std::uint16_t* object = nullptr;
};

/// Gives every brick the memory that it needs. Bricks that need no merge are filled here.
std::vector<Target> make_targets(std::span<const workspace::BrickKey> keys, const Candidates& candidates,
                                 workspace::Workspace& workspace) {
  for (const workspace::BrickKey key : keys) workspace.remove_brick(key);
  workspace.reserve_more(most_made(keys, candidates));
  std::vector<Target> targets(keys.size());
  for (std::size_t i = 0; i < keys.size(); ++i) {
    const std::span<const Candidate> on_it = candidates.on(i);
    if (on_it.empty()) continue;
    const MergeEntry& first = *on_it[0].entry;
    if (interior_alone(keys[i], on_it)) {
      workspace.fill_brick(keys[i], (*first.codes)[static_cast<std::uint8_t>(workspace::kOrderInterior)],
                           workspace::kOrderInterior, first.id);
      continue;
    }
    workspace::BrickLabels labels{nullptr, nullptr, first.id};
    if (on_it.size() == 1) labels.orders = first.bricks->share(keys[i]);
    if (on_it.size() > 1) {
      labels.orders = std::make_shared_for_overwrite<std::int8_t[]>(workspace::kBrickVoxels);
      labels.objects = std::make_shared_for_overwrite<std::uint16_t[]>(workspace::kBrickVoxels);
      targets[i] = {nullptr, labels.orders.get(), labels.objects.get()};
    }
    targets[i].mu_code = workspace.make_brick(keys[i], std::move(labels));
  }
  return targets;
}

/// One thread's work space: codes set by candidates of a greater rank, which later candidates cannot change.
using Locked = std::array<std::uint8_t, workspace::kBrickVoxels>;

void merge_brick(std::span<const Candidate> candidates, const Target& brick, Locked& kept) {
  const MergeEntry& first = *candidates[0].entry;
  detail::codes_of(*first.codes, candidates[0].orders, first.id, brick.mu_code, brick.object);
  if (candidates.size() == 1) return;  // the brick shares the object's orders
  std::memcpy(brick.order, candidates[0].orders, workspace::kBrickVoxels);
  const std::uint8_t* locked = nullptr;
  for (std::size_t c = 1; c < candidates.size(); ++c) {
    const MergeEntry& entry = *candidates[c].entry;
    if (entry.rank != candidates[c - 1].entry->rank) {
      std::memcpy(kept.data(), brick.mu_code, workspace::kBrickVoxels);
      locked = kept.data();
    }
    detail::merge_candidate(*entry.codes, candidates[c].orders, entry.id, locked, brick.mu_code, brick.order,
                            brick.object);
  }
}

}  // namespace

std::vector<workspace::BrickKey> keys_of(std::span<const MergeEntry> entries) {
  std::vector<workspace::BrickKey> keys;
  for (const MergeEntry& entry : entries)
    keys.insert(keys.end(), entry.bricks->keys().begin(), entry.bricks->keys().end());
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  return keys;
}

void merge_bricks(MergeLaw law, std::span<const MergeEntry> entries,
                  std::span<const workspace::BrickKey> keys, workspace::Workspace& workspace, int threads) {
  const std::vector<MergeEntry> strongest_first = by_priority(law, entries);
  const Candidates candidates = candidates_for(keys, strongest_first);
  const std::vector<Target> targets = make_targets(keys, candidates, workspace);
  std::vector<Locked> locked(static_cast<std::size_t>(std::max(1, threads)));
  core::parallel_for(threads, keys.size(), [&](std::size_t i, std::size_t worker) {
    if (targets[i].mu_code != nullptr) merge_brick(candidates.on(i), targets[i], locked[worker]);
  });
}

}  // namespace phantom::layers
