#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/fusion/incremental_layers.hpp"
#include "common/layers/live_workspace.hpp"
#include "common/messages/living.hpp"
#include "components/wva_server/live/live_intake.hpp"
#include "components/wva_server/live/live_objects.hpp"

namespace phantom::wva_server {

using messages::kLiveId;
using messages::kLiveName;

/// What becomes of live matter whose source is silent.
enum class OnLoss : std::uint8_t { kKeep, kEnd };

/// Where live matter comes from, and how it is told from the model.
struct LiveRules {
  std::string source;     ///< name of the process whose occupancy_change is taken; empty: there is none
  int tolerance_vox = 4;  ///< voxels so near to a solid of the model are the model's
  int min_voxels = 32;    ///< smaller connected parts are what is left of the model's edges: no matter
  int join_vox = 3;       ///< parts so near to one another are one thing; 1: if they touch
  /// Layers of live matter; without a thickness those of the cell.
  workspace::LayerProfile profile;
  OnLoss on_loss = OnLoss::kKeep;
  double silence_s = 0.5;  ///< after which the source is lost

  bool wanted() const { return !source.empty(); }
};

/// Occupied voxels that no object of the model explains, as objects of the workspace with layers: each thing
/// that cameras see has an id as long as it is followed (LiveObjects), and what no id is left for shares
/// kLiveId. The layers of each equal what its voxels make from nothing. One thread; not real-time safe.
class LiveMatter {
 public:
  /// Refuses a grid or a profile that live matter cannot have, and a tolerance out of 0…20 voxels.
  static core::Expected<LiveMatter> create(const workspace::GridSpec& grid, const LiveRules& rules);

  const workspace::LayerProfile& profile() const { return profile_; }
  /// Takes what depth cameras see. Blocks beyond the grid are left out.
  void take(const LiveIntake::Taken& seen);
  /// Takes which voxels the model's objects fill.
  void set_model(const workspace::BitVolume& solid);

  /// Brings the objects and their layers up to date. Returns those that differ from the update before.
  std::vector<layers::ComputedObject> update(core::Nanoseconds now_ns);
  /// Returns whether an object is waiting to be forgotten: then update() must be called now and then.
  bool expires() const;

  const LiveObjects& objects() const { return objects_; }
  // What a person decides (LiveObjects). The next update() carries it out.
  core::Status freeze(std::uint16_t id);
  core::Status discard(std::uint16_t id, core::Nanoseconds now_ns);
  core::Status restore(std::uint16_t id, core::Nanoseconds now_ns);
  core::Status rename(std::uint16_t id, const std::string& name) { return objects_.rename(id, name); }
  void drop_name(std::uint16_t id) { objects_.drop_name(id); }

  /// Returns the number of voxels of all.
  std::size_t voxels() const;
  /// Returns the middle in W of the voxels that the last update() gave an id; nothing, if there are none.
  std::optional<Eigen::Vector3d> middle_m(std::uint16_t id) const;

 private:
  /// What is in the workspace of an id.
  struct Shown {
    fusion::IncrementalLayers layers;
    LivePart part;
  };
  LiveMatter(const workspace::GridSpec& grid, const LiveRules& rules,
             std::optional<fusion::IncrementalLayers> near);

  void touch(workspace::Index3 block);
  void set_block(workspace::Index3 block, const std::array<std::uint64_t, 8>& bits);
  void note_near(workspace::BrickKey key, const std::int8_t* orders);
  bool renew(workspace::Index3 block);
  std::vector<LivePart> large_parts();
  void collect_part(workspace::Index3 from);
  void mask(const LivePart& part);
  void renew_masks();
  bool is_seen_at(const LivePart& part) const;
  void look_at_discarded(core::Nanoseconds now_ns);
  std::optional<layers::ComputedObject> show(std::uint16_t id, const LivePart& part);

  workspace::GridSpec grid_;
  workspace::LayerProfile profile_;
  int tolerance_vox_;
  std::size_t min_voxels_;
  int join_vox_;
  std::optional<fusion::IncrementalLayers> near_layers_;  // of the model; none: no tolerance
  workspace::BitVolume seen_, model_, near_;
  workspace::BitVolume masked_;       // of what a person has decided about, and near to it
  workspace::BitVolume unexplained_;  // seen, and neither near to the model nor masked
  workspace::BitVolume left_;         // during update(): not looked at yet
  workspace::BitVolume scratch_;      // during show(): the voxels of one part
  workspace::VoxelBox blocks_;        // of the grid
  std::vector<std::uint8_t> is_touched_, is_seen_, is_unexplained_;  // by blocks_.index()
  std::vector<workspace::Index3> touched_, unexplained_blocks_, part_;
  LiveObjects objects_;
  LivePart rest_;
  std::map<std::uint16_t, Shown> shown_;
  bool decided_ = false;  // a person has decided something since the last update
};

}  // namespace phantom::wva_server
