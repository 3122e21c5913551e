#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/workspace/workspace_assembler.hpp"

namespace phantom::workspace {

/// Identifies the process that sent a sample.
using SourceId = std::array<std::uint8_t, 12>;

/// Assembles the workspace when more than one server may send. The samples of each source are assembled
/// separately, so that no brick or version of one source can corrupt the workspace of another. The first
/// source whose workspace is complete is in force for as long as it is present. After it has gone, its
/// workspace stays in force until that of another source is complete. A description is checked before it is
/// used. Each source's workspace may take `most_bytes`. While the source in force is present, nothing is
/// built for the others: each keeps its bricks as they came, and these may take twice as much as those of the
/// one in force, and kMinReceivedBytes at least. Whoever sends more meanwhile, or is one source too many,
/// is forgotten and has to send its workspace again once attended() is false. Not thread-safe. Real-time
/// safe: no.
class WorkspaceSources {
 public:
  /// Greatest number of sources at a time; samples of further sources are refused (kResourceExhausted).
  static constexpr std::size_t kMax = 3;
  static constexpr std::size_t kMinReceivedBytes = std::size_t{16} << 20;

  explicit WorkspaceSources(std::size_t most_bytes = SIZE_MAX) : most_bytes_(most_bytes) {}

  /// Takes the newest state of one brick of a source, as WorkspaceAssembler::put_brick(). If there is no
  /// room for it beside the source in force (kResourceExhausted), forgets all that its source sent.
  core::Status put_brick(const SourceId& source, BrickKey key, std::uint64_t version,
                         std::span<const std::uint8_t> bytes);
  /// Takes a source's newest committed version, as WorkspaceAssembler::commit(). Also refuses what no server
  /// sends: version 0, a version lower than the one that the same source committed last, and that version
  /// again with other content.
  core::Status commit(const SourceId& source, const VersionDescription& description);
  /// Reports that a source has ended or is not heard any more.
  void gone(const SourceId& source);
  /// Does the same as WorkspaceAssembler::prepare() for the source in force.
  void prepare();

  /// Returns the newest complete version of the source in force; null before the first.
  const std::shared_ptr<const Workspace>& current() const;
  /// Returns the greatest μ of any layer or guard voxel in current(), Pa·s/m; 0 if there are none.
  double greatest_neighbour_mu() const;
  /// Returns the newest version that the source in force has committed. After that source has gone, returns
  /// its successor's version as soon as there is one. 0: none.
  std::uint64_t announced() const;
  std::optional<SourceId> in_force() const;
  /// Returns whether the source in force is present.
  bool attended() const { return in_force_ != nullptr && !in_force_->gone; }
  /// Returns whether more than one source is present.
  bool contested() const;

 private:
  struct Source {
    SourceId id;
    WorkspaceAssembler assembler = {};
    std::uint64_t version = 0, content_hash = 0;  // committed last
    bool gone = false;
  };
  Source* find(const SourceId& id);
  Source* find_or_add(const SourceId& id);
  void choose();
  void arrange();
  void allow(Source& source) const;

  std::size_t most_bytes_;
  std::vector<std::unique_ptr<Source>> sources_;  // in the order in which they were first heard
  Source* in_force_ = nullptr;                    // one of sources_
};

}  // namespace phantom::workspace
