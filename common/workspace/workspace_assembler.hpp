#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <vector>

#include "common/core/status.hpp"
#include "common/workspace/brick_codec.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::workspace {

/// Greatest number of bricks along an axis: 8192 voxels.
inline constexpr std::int32_t kMaxBricks = 8192 / kBrickEdge;
/// Greatest number of bricks of a workspace: as many as topic workspace_brick holds.
inline constexpr std::size_t kMaxBricksInAll = 262144;

/// Holds the content of a WorkspaceVersion sample.
struct VersionDescription {
  std::uint64_t version = 0;
  GridSpec grid;
  std::vector<float> palette_Pa_s_per_m;
  std::uint32_t brick_count = 0;
  std::uint64_t content_hash = 0;
};

/// Returns the description of a workspace whose content hash is `content_hash`.
VersionDescription description_of(const Workspace& workspace, std::uint64_t content_hash);
/// Refuses a description whose grid or palette no workspace can have.
core::Status check(const VersionDescription& description);

/// Collects bricks in any order and builds a Workspace from them once their count and hash show that a
/// committed version is complete. This is the consumer's side of the workspace topics. A half-updated volume
/// is never visible: current() stays the last complete version until the next one is complete.
///
///     reader of workspace_brick:   put_brick
///     reader of workspace_version: commit
///     after each call:             if (assembler.current() != mine) { mine = assembler.current(); … }
///
/// A version that changes some bricks of the previous one costs those bricks only. It is built in the buffer
/// of the last version but one once nobody holds that buffer any more, otherwise in a new buffer. Bricks that
/// wait for their version are kept as received, compressed.
///
/// Bricks left behind by a server that died, which its successor never names, are recognised by their lower
/// version and dropped. If a version has another grid than current(), its volume is built while
/// its bricks arrive, once the version has been committed; it stays invisible until it is complete.
///
/// Bounded in memory: a brick is refused if the workspace of all bricks would have more than
/// kMaxBricksInAll bricks or take more than `most_bytes`, or if the bricks as received take too much.
///
/// Not thread-safe: samples arrive on middleware threads, so lock around every call. Not real-time safe.
class WorkspaceAssembler {
 public:
  WorkspaceAssembler() = default;
  explicit WorkspaceAssembler(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Sets new bounds for bricks that come from now on: of a workspace of all held bricks, and of these bricks
  /// as they were received.
  void allow(std::size_t most_bytes, std::size_t most_received_bytes) {
    most_bytes_ = most_bytes;
    most_received_bytes_ = most_received_bytes;
  }
  /// Returns what a workspace of all held bricks takes, or somewhat more.
  std::size_t bytes() const { return bytes_; }
  /// Returns what all held bricks took as they were received, with what it takes to keep each.
  std::size_t received_bytes() const { return received_bytes_; }
  /// Keeps bricks as they are received and builds nothing until this is called with false; what is complete
  /// then is built at once.
  void keep_packed(bool packed);

  /// Takes the newest state of one brick. Empty bytes mean that the brick does not exist any more. Refuses
  /// bytes that are not a brick, and keys that no grid can have.
  core::Status put_brick(BrickKey key, std::uint64_t version, std::span<const std::uint8_t> bytes);
  void remove_brick(BrickKey key);
  /// Takes the newest committed version, which is checked.
  core::Status commit(const VersionDescription& description);
  /// Brings the second buffer up to date, so that the next version need not do so. Call it when idle. Does
  /// nothing while somebody still holds that buffer.
  void prepare();

  /// Returns the newest complete version; null before the first.
  const std::shared_ptr<const Workspace>& current() const { return current_; }
  /// Returns the greatest μ of any layer or guard voxel in current(), Pa·s/m; 0 if there are none.
  double greatest_neighbour_mu() const { return greatest_neighbour_mu_; }
  /// Returns whether a committed version is not complete yet.
  bool pending() const { return pending_.has_value(); }
  std::size_t bricks_held() const { return held_.size(); }
  /// Returns the number of bricks of the pending version, or of the current one if none is pending.
  std::size_t bricks_expected() const;
  /// Returns how many bricks were written to build current(), that is the cost of the change.
  std::size_t bricks_written() const { return bricks_written_; }

 private:
  struct Held {
    std::uint64_t version;
    std::uint64_t hash;
    std::vector<std::uint8_t> packed;  // encoded; empty: stored in forming_ if `formed`, else in current_
    bool formed;
    std::uint8_t greatest_code;
    std::uint8_t greatest_fluid_code;  // among voxels of layers and guard
    std::uint32_t kind;                // of a uniform brick, see kind_of(); else kNotUniform
    std::size_t bytes;                 // without what it shares with others of its kind
    std::size_t received_bytes;
  };
  /// Sums up the held bricks of one version.
  struct Tally {
    std::size_t count = 0;
    std::uint64_t hash = 0;
  };
  core::Status check_room(BrickKey key, const Held& held) const;
  void forget(BrickKey key);
  void take_up(const VersionDescription& description);
  void try_commit();
  void drop_left_overs();
  bool fits(const VersionDescription& description) const;
  void build(const VersionDescription& description);
  void begin_forming(const VersionDescription& description);
  void end_forming();
  bool spare_usable(const GridSpec& grid) const;
  void write_brick(Workspace& to, BrickKey key);

  std::map<BrickKey, Held> held_;
  std::map<std::uint64_t, Tally> tallies_;      // by version
  std::map<std::uint32_t, std::size_t> kinds_;  // number of held uniform bricks by kind
  std::size_t most_bytes_ = SIZE_MAX, bytes_ = 0;
  std::size_t most_received_bytes_ = SIZE_MAX, received_bytes_ = 0;
  bool packed_ = false;
  std::uint64_t hash_sum_ = 0;  // Σ of held_'s hashes
  std::set<BrickKey> changed_;  // where held_ may differ from current_
  std::optional<VersionDescription> pending_;
  std::shared_ptr<Workspace> forming_;  // for pending_, if its grid differs from current_'s
  std::shared_ptr<const Workspace> current_;
  double greatest_neighbour_mu_ = 0.0;
  std::shared_ptr<Workspace> buffer_;  // current_, as the mutable pointer
  std::shared_ptr<Workspace> spare_;   // the previous version, or a copy of current_
  std::set<BrickKey> spare_behind_;    // where spare_ differs from current_
  std::size_t bricks_written_ = 0;
  std::unique_ptr<BrickContent> scratch_ = std::make_unique<BrickContent>();
};

}  // namespace phantom::workspace
