#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/core/status.hpp"
#include "common/workspace/object_bricks.hpp"
#include "common/workspace/profile.hpp"
#include "common/workspace/voxel_box.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::fusion {

/// Returns all layers of an occupancy from nothing, by the `distance` method: every occupied voxel is
/// boundary.
workspace::ObjectBricks layers_of(const workspace::BitVolume& occupied, const workspace::GridSpec& grid,
                                  const workspace::LayerProfile& profile);

/// What an update changed.
struct LayersChange {
  std::vector<workspace::BrickKey> changed;  ///< bricks with another content, new ones included
  std::vector<workspace::BrickKey> removed;  ///< bricks that hold nothing any more
  std::size_t computed = 0;                  ///< bricks that were computed
};

/// The layers around a changing occupancy. Every version equals layers_of() the same occupancy, byte for
/// byte; an update computes only the bricks within the profile's reach of what changed. Not thread-safe, not
/// real-time safe: new bricks take memory.
class IncrementalLayers {
 public:
  /// Starts with nothing occupied. Refuses a profile that is not valid, has layers inside or another method
  /// than `distance`, and voxels that are no cubes.
  static core::Expected<IncrementalLayers> create(const workspace::GridSpec& grid,
                                                  const workspace::LayerProfile& profile);

  /// Follows the occupancy. `changed_blocks`: every block of 8³ voxels with a changed voxel
  /// (Fusion::changed_blocks()); others do no harm.
  const LayersChange& update(const workspace::BitVolume& occupied,
                             std::span<const workspace::Index3> changed_blocks);

  /// Returns the present layers. The bricks are shared and never changed later.
  workspace::ObjectBricks bricks() const;

 private:
  IncrementalLayers(const workspace::GridSpec& grid, const workspace::LayerProfile& profile);

  void find_affected(std::span<const workspace::Index3> changed_blocks);
  workspace::VoxelBox next_box(workspace::Index3 first);
  void compute(const workspace::BitVolume& occupied, const workspace::VoxelBox& bricks);
  void replace(workspace::BrickKey key, std::shared_ptr<std::int8_t[]> orders);

  workspace::GridSpec grid_;
  workspace::LayerProfile profile_;
  workspace::VoxelBox bricks_;                          // of the grid
  std::vector<std::shared_ptr<std::int8_t[]>> orders_;  // by bricks_.index(); null: nothing
  std::vector<std::uint8_t> affected_;                  // by bricks_.index()
  std::vector<workspace::VoxelBox> changes_;            // of voxels, one for each brick with a change
  LayersChange change_;
};

}  // namespace phantom::fusion
