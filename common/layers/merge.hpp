#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/workspace/object_bricks.hpp"
#include "common/workspace/profile.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::layers {

/// Whose voxel it is where several objects claim one (spec 1.6). An object claims the voxels in which it has
/// an order other than free; object and order follow the winner's μ.
enum class MergeLaw : std::uint8_t {
  kHighestViscosity,  ///< the higher μ prevails; where they are equal, the lower object id
  kLatestObject,      ///< the greater rank prevails, rank being when the object came or was last moved
  kObjectPriority     ///< the greater rank prevails, rank being the object's priority
};

/// One object as the merge takes it. Of equal ranks kHighestViscosity decides.
struct MergeEntry {
  const workspace::ObjectBricks* bricks;
  std::uint16_t id;                   ///< 1…65534, each once
  const workspace::CodeTable* codes;  ///< μ code by order; above 0 for every order that the object has
  std::int64_t rank = 0;              ///< not used by kHighestViscosity
};

/// Every brick in which an entry has something, each once, in BrickKey's order.
std::vector<workspace::BrickKey> keys_of(std::span<const MergeEntry> entries);

/// Makes exactly those bricks of the workspace anew from all entries, and removes those in which nobody has
/// anything. The result depends neither on the order of the entries nor on the number of threads, nor on what
/// stood in the bricks. `keys`: each once, inside the workspace. Not real-time safe.
void merge_bricks(MergeLaw law, std::span<const MergeEntry> entries,
                  std::span<const workspace::BrickKey> keys, workspace::Workspace& workspace,
                  int threads = 1);

}  // namespace phantom::layers
