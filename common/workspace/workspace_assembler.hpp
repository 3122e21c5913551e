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
///     reader of workspace_brick:   put_brick
///     reader of workspace_version: commit
///     after each call:             if (assembler.current() != mine) { mine = assembler.current(); … }
///
/// A version that changes some bricks of the one before costs those bricks only: it is made in the buffer of
/// the last version but one, as soon as nobody holds that any more (otherwise in a new one). Bricks that wait
/// for their version are kept as they came, compressed.
///
/// Bricks that a server left behind when it died (its successor never names them) are found by their lower
/// version and dropped. A volume that cannot be made of the current one is formed while its bricks come, once
/// its version has told grid and palette; nobody sees it before it is whole. Not thread-safe: samples come on
/// middleware threads, so lock around every call. Not real-time safe.
class WorkspaceAssembler {
 public:
  /// Takes the newest state of one brick; no bytes: it exists no more. Refuses bytes that are no brick and
  /// keys that no grid can have.
  core::Status put_brick(BrickKey key, std::uint64_t version, std::span<const std::uint8_t> bytes);
  void remove_brick(BrickKey key);
  /// Takes the newest committed version. Refuses a description that contradicts itself (grid, palette).
  core::Status commit(const VersionDescription& description);
  /// Brings the second buffer up to date, so that the next version need not: to be called when there is
  /// nothing else to do. Does nothing while somebody still holds that buffer.
  void prepare();

  /// The newest whole version; null before the first.
  const std::shared_ptr<const Workspace>& current() const { return current_; }
  /// Greatest μ of any layer or guard voxel in current(), Pa·s/m; 0 if there are none.
  double greatest_neighbour_mu() const { return greatest_neighbour_mu_; }
  /// A version was committed that is not whole yet.
  bool pending() const { return pending_.has_value(); }
  std::size_t bricks_held() const { return held_.size(); }
  /// Bricks of the committed version that is awaited, or of the current one.
  std::size_t bricks_expected() const;
  /// Bricks that were copied to make current(): what its change cost.
  std::size_t bricks_written() const { return bricks_written_; }

 private:
  struct Held {
    std::uint64_t version;
    std::uint64_t hash;
    std::vector<std::uint8_t> packed;  // encoded; empty: as in forming_ or else in current_
    bool formed;
    std::uint8_t greatest_code;
    std::uint8_t greatest_fluid_code;  // of layers and guard
  };
  /// Bricks held of one version, together.
  struct Tally {
    std::size_t count = 0;
    std::uint64_t hash = 0;
  };
  void forget(BrickKey key);
  void try_commit();
  void drop_left_overs();
  bool fits(const VersionDescription& description) const;
  void build(const VersionDescription& description);
  void begin_forming(const VersionDescription& description);
  void end_forming();
  bool spare_usable(const GridSpec& grid, const std::vector<float>& palette_Pa_s_per_m) const;
  void write_brick(Workspace& to, BrickKey key);

  std::map<BrickKey, Held> held_;
  std::map<std::uint64_t, Tally> tallies_;  // by version
  std::uint64_t hash_sum_ = 0;              // Σ of held_'s hashes
  std::set<BrickKey> changed_;              // where held_ may differ from current_
  std::optional<VersionDescription> pending_;
  std::shared_ptr<Workspace> forming_;  // for pending_, if it cannot be made of the one before
  std::shared_ptr<const Workspace> current_;
  double greatest_neighbour_mu_ = 0.0;
  std::shared_ptr<Workspace> buffer_;  // current_, as it was before it was shared
  std::shared_ptr<Workspace> spare_;   // the version before, or a copy
  std::set<BrickKey> spare_behind_;    // where spare_ differs from current_
  std::size_t bricks_written_ = 0;
  std::unique_ptr<BrickContent> scratch_ = std::make_unique<BrickContent>();
};

}  // namespace phantom::workspace
