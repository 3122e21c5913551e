#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "common/core/status.hpp"
#include "common/layers/activation.hpp"
#include "common/layers/merge.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::layers {

/// The effect of a change of the workspace.
struct WorkspaceChange {
  std::uint64_t version = 0;                 ///< version of the workspace with the change
  std::vector<workspace::BrickKey> changed;  ///< bricks with new content, in rising order
  std::vector<workspace::BrickKey> removed;  ///< bricks that no longer exist, in rising order
  std::vector<BodyReport> reports;           ///< of the bodies that the change activated
  bool codes_changed = false;  ///< every μ may have another code, so `changed` may be all bricks
  double merge_s = 0.0;        ///< measured by the options' stopwatch
};

/// A body to add. It need only live as long as the call.
struct LiveBody {
  const Body* body = nullptr;
  std::int64_t priority = 0;  ///< for MergeLaw::kObjectPriority: the greater wins
};

/// Voxels that the caller has computed, for an object.
struct ComputedObject {
  std::uint16_t id = 0;
  workspace::ObjectBricks bricks;  ///< may hold nothing: then its profile alone is there
  workspace::LayerProfile profile;
  std::vector<workspace::BrickKey> touched;  ///< every brick in which it differs from before
};

/// A workspace whose objects are added, moved and removed (spec 1.6). Keeps each object's own voxels besides
/// the merged ones. So a change costs the activation of one object, and a new merge of the bricks that it
/// left and entered.
///
/// The workspace always has the μ, orders and objects that result from activating its present objects all at
/// once: no change leaves a trace in them. The palette keeps its codes (workspace::next_palette), so that a μ
/// that an object brings along or takes away changes no brick that the object does not touch; only where the
/// palette has no free code between two others are all codes given anew, and all bricks change.
///
/// Merging is work, too: it is counted for options.budget before it begins (merge_steps()), and ends soon
/// after options.keep_going returned false.
///
/// Every call either succeeds as a whole, or returns a Status whose message names the object and leaves
/// everything as before. Not thread-safe, not real-time safe.
class LiveWorkspace {
 public:
  /// Creates an empty workspace of version 0.
  LiveWorkspace(const workspace::GridSpec& grid, MergeLaw law) : law_(law), workspace_(grid, {0.0F}) {}

  /// Called after each body with its report and the number of bodies done.
  using OnBody = std::function<void(const Body& body, const BodyReport& report, std::size_t done)>;

  /// Adds all of the bodies, or none. Refuses ids that are 0, 65535 or taken, and a version that does not
  /// increase.
  core::Expected<WorkspaceChange> add(std::span<const LiveBody> bodies, std::uint64_t version,
                                      const ActivationOptions& options = {}, const OnBody& on_body = {});
  /// Replaces the object that has the id of `body`, with another pose, shape or profile. With
  /// MergeLaw::kLatestObject it becomes the latest.
  core::Expected<WorkspaceChange> move(const Body& body, std::uint64_t version,
                                       const ActivationOptions& options = {});
  core::Expected<WorkspaceChange> remove(std::uint16_t id, std::uint64_t version,
                                         const ActivationOptions& options = {});
  /// Gives objects the voxels that the caller has computed, or adds them with these; all or none. The μ of an
  /// object without voxels keep their codes. Only the bricks that are touched are merged. With
  /// MergeLaw::kLatestObject an object stays as late as it was.
  core::Expected<WorkspaceChange> put(std::vector<ComputedObject> objects, std::uint64_t version,
                                      const ActivationOptions& options = {});
  /// Makes a new version with the same content.
  core::Expected<WorkspaceChange> renew(std::uint64_t version, const ActivationOptions& options = {});

  const workspace::Workspace& workspace() const { return workspace_; }
  /// Moves the workspace out, for callers that need no more changes.
  workspace::Workspace take() && { return std::move(workspace_); }
  /// Equals workspace().content_hash(), without reading the voxels.
  std::uint64_t content_hash() const { return content_hash_; }
  std::size_t object_count() const { return objects_.size(); }
  /// Returns which voxels are boundary, interior or inside of any object that `counts`.
  workspace::BitVolume solid(const std::function<bool(std::uint16_t id)>& counts) const;
  /// Returns the work of merging that many bricks of so many objects, in steps of a formula
  /// (core::WorkBudget): each brick is put together, hashed, packed and sent; each object is looked up in it,
  /// and merged where it is. `held`: in how many of the bricks the objects are, in all.
  static std::uint64_t merge_steps(std::size_t bricks, std::size_t objects, std::uint64_t held) {
    return bricks * (8192 + 4 * std::uint64_t{objects}) + 512 * held;
  }
  /// Memory of the objects' own voxels, not counting the workspace's.
  std::size_t object_bytes() const;

 private:
  struct Object {
    std::shared_ptr<const workspace::ObjectBricks> bricks;
    workspace::LayerProfile profile;
    std::int64_t priority = 0;
    std::int64_t latest = 0;  ///< rising number, given when it was added or last moved
  };
  using Objects = std::map<std::uint16_t, Object>;

  core::Expected<Object> activated(const Body& body, const ActivationOptions& options,
                                   WorkspaceChange& change) const;
  core::Expected<WorkspaceChange> apply(Objects next, std::vector<workspace::BrickKey> touched,
                                        WorkspaceChange change, std::uint64_t version,
                                        const ActivationOptions& options);
  std::size_t merge(const Objects& objects, std::span<const workspace::BrickKey> keys,
                    workspace::Workspace& workspace, const ActivationOptions& options) const;
  static std::uint64_t steps_to_merge(const Objects& objects, std::span<const workspace::BrickKey> touched);
  void reserve_for(std::span<const workspace::BrickKey> keys);
  void take_hashes(std::span<const workspace::BrickKey> keys, std::span<const std::uint64_t> hashes,
                   WorkspaceChange& change);

  MergeLaw law_;
  workspace::Workspace workspace_;
  Objects objects_;
  std::map<workspace::BrickKey, std::uint64_t> hashes_;
  std::uint64_t content_hash_ = 0;
  std::int64_t latest_ = 0;
  std::size_t reserved_bricks_ = 0;
};

}  // namespace phantom::layers
