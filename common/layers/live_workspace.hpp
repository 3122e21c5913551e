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

/// What a change of the workspace did.
struct WorkspaceChange {
  std::uint64_t version = 0;                 ///< the version that has it
  std::vector<workspace::BrickKey> changed;  ///< bricks whose content is new, rising
  std::vector<workspace::BrickKey> removed;  ///< bricks that exist no more, rising
  std::vector<BodyReport> reports;           ///< of the bodies that were activated for it
  bool palette_changed = false;              ///< codes mean other viscosities: `changed` may be all bricks
  double merge_s = 0.0;                      ///< by the options' stopwatch
};

/// A body to be added; outlives the call only.
struct LiveBody {
  const Body* body = nullptr;
  std::int64_t priority = 0;  ///< for MergeLaw::kObjectPriority: the greater prevails
};

/// A workspace whose objects come, move and go (spec 1.6). Keeps each object's own voxels beside the merged
/// ones, so that a change costs the activation of one object and a new merge of the bricks that it left and
/// entered.
///
/// The workspace is always what the objects that are in it now make, activated all at once: no change leaves
/// a trace. So its palette is theirs; an object that brings a μ of its own, or takes it away, shifts the
/// codes of the others, and all bricks that hold a shifted code change with it.
///
/// Every call either succeeds as a whole or returns a Status (its message names the object) with everything
/// as before. Not thread-safe, not real-time safe.
class LiveWorkspace {
 public:
  /// Empty, of version 0.
  LiveWorkspace(const workspace::GridSpec& grid, MergeLaw law) : law_(law), workspace_(grid, {0.0F}) {}

  /// Called after each body with what was found about it and how many are done.
  using OnBody = std::function<void(const Body& body, const BodyReport& report, std::size_t done)>;

  /// Adds all of the bodies, or none. Refuses ids that are 0, 65535 or taken, and a version that does not
  /// rise.
  core::Expected<WorkspaceChange> add(std::span<const LiveBody> bodies, std::uint64_t version,
                                      const ActivationOptions& options = {}, const OnBody& on_body = {});
  /// Puts `body` in place of the object with its id: at another pose, or of another shape or profile. With
  /// MergeLaw::kLatestObject it is the latest from then on.
  core::Expected<WorkspaceChange> move(const Body& body, std::uint64_t version,
                                       const ActivationOptions& options = {});
  core::Expected<WorkspaceChange> remove(std::uint16_t id, std::uint64_t version,
                                         const ActivationOptions& options = {});

  const workspace::Workspace& workspace() const { return workspace_; }
  /// The workspace alone, for who wants no more changes.
  workspace::Workspace take() && { return std::move(workspace_); }
  /// workspace().content_hash(), without a look at the voxels.
  std::uint64_t content_hash() const { return content_hash_; }
  std::size_t object_count() const { return objects_.size(); }
  /// Memory of the objects' own voxels, besides the workspace's.
  std::size_t object_bytes() const;

 private:
  struct Object {
    std::shared_ptr<const workspace::ObjectBricks> bricks;
    workspace::LayerProfile profile;
    std::int64_t priority = 0;
    std::int64_t latest = 0;  ///< when it came or was moved last: rising numbers
  };
  using Objects = std::map<std::uint16_t, Object>;

  core::Expected<Object> activated(const Body& body, const ActivationOptions& options,
                                   WorkspaceChange& change) const;
  core::Expected<WorkspaceChange> apply(Objects next, std::vector<workspace::BrickKey> touched,
                                        WorkspaceChange change, std::uint64_t version,
                                        const ActivationOptions& options);
  void merge(const Objects& objects, std::span<const workspace::BrickKey> keys,
             workspace::Workspace& workspace, int threads) const;
  void reserve_for(std::span<const workspace::BrickKey> keys);
  void take_hashes(std::span<const workspace::BrickKey> keys, int threads, WorkspaceChange& change);

  MergeLaw law_;
  workspace::Workspace workspace_;
  Objects objects_;
  std::map<workspace::BrickKey, std::uint64_t> hashes_;
  std::uint64_t content_hash_ = 0;
  std::int64_t latest_ = 0;
  std::size_t reserved_bricks_ = 0;
};

}  // namespace phantom::layers
