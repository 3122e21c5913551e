#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/core/status.hpp"
#include "common/voxel/brick_codec.hpp"
#include "common/voxel/workspace.hpp"

namespace phantom::voxel {

/// What a WorkspaceVersion sample says of a version.
struct VersionDescription {
  std::uint64_t version = 0;
  GridSpec grid;
  std::vector<float> palette_Pa_s_per_m;
  std::uint32_t brick_count = 0;
  std::uint64_t content_hash = 0;
};

/// The consumer's side of the workspace topics: collects bricks as they come, in any order, and makes a
/// Workspace of them when count and hash say that a committed version is whole. Never shows a half-updated
/// volume: until the next version is whole, current() stays the last whole one.
///
///     reader of workspace_brick:   put_brick / remove_brick (dispose)
///     reader of workspace_version: commit
///     after each call:             if (assembler.current() != mine) { mine = assembler.current(); … }
///
/// Bricks that a server left behind when it died (its successor never names them) are found by their lower
/// version and dropped. Not thread-safe: samples come on middleware threads, so lock around every call. Not
/// real-time safe.
class WorkspaceAssembler {
 public:
  /// Takes the newest state of one brick. Refuses bytes that are no brick and keys that no grid can have.
  core::Status put_brick(BrickKey key, std::uint64_t version, std::span<const std::uint8_t> bytes);
  void remove_brick(BrickKey key);
  /// Takes the newest committed version. Refuses a description that contradicts itself (grid, palette).
  core::Status commit(const VersionDescription& description);

  /// The newest whole version; null before the first.
  const std::shared_ptr<const Workspace>& current() const { return current_; }
  /// A version was committed that is not whole yet.
  bool pending() const { return pending_.has_value(); }
  std::size_t bricks_held() const { return held_.size(); }
  /// Bricks of the committed version that is awaited, or of the current one.
  std::size_t bricks_expected() const;

 private:
  struct Held {
    std::uint64_t version;
    std::uint64_t hash;
    std::shared_ptr<const BrickData> data;  // null: as in current_
    std::uint8_t greatest_code;
  };
  void forget(BrickKey key);
  void try_commit();
  void drop_left_overs();
  bool fits(const VersionDescription& description) const;
  void build(const VersionDescription& description);

  std::map<BrickKey, Held> held_;
  std::uint64_t hash_sum_ = 0;  // Σ of held_'s hashes
  std::optional<VersionDescription> pending_;
  std::shared_ptr<const Workspace> current_;
};

}  // namespace phantom::voxel
