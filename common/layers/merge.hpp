#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/workspace/object_bricks.hpp"
#include "common/workspace/profile.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::layers {

/// Which object gets a voxel that several claim (spec 1.6). An object claims the voxels in which its order is
/// not free. The winner gives the voxel's μ, object and order.
enum class MergeLaw : std::uint8_t {
  kHighestViscosity,  ///< the higher μ wins; if equal, the lower object id
  kLatestObject,      ///< the greater rank wins; it says when the object was added or last moved
  kObjectPriority     ///< the greater rank wins; it is the object's priority
};

/// One object to merge. Between equal ranks kHighestViscosity decides.
struct MergeEntry {
  const workspace::ObjectBricks* bricks;
  std::uint16_t id;                   ///< 1…65534, each only once
  const workspace::CodeTable* codes;  ///< μ code for each order; above 0 for every order that the object has
  std::int64_t rank = 0;              ///< not used by kHighestViscosity
};

/// Returns every brick in which an entry has anything, each once, in BrickKey's order.
std::vector<workspace::BrickKey> keys_of(std::span<const MergeEntry> entries);

/// Rebuilds exactly the bricks `keys` of the workspace from all entries, and removes those in which no entry
/// has anything. The result does not depend on the order of the entries, the number of threads or the
/// previous content. `keys` must be unique and inside the workspace. Not real-time safe.
void merge_bricks(MergeLaw law, std::span<const MergeEntry> entries,
                  std::span<const workspace::BrickKey> keys, workspace::Workspace& workspace,
                  int threads = 1);

}  // namespace phantom::layers
