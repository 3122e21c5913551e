#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "common/workspace/workspace_assembler.hpp"

namespace phantom::workspace {

/// Names the process that a sample came from.
using SourceId = std::array<std::uint8_t, 12>;

/// The consumer's side of the workspace topics where more than one server may send: every source's samples
/// are assembled for themselves, so that no brick and no version of one can spoil the workspace of another.
/// In force is the first source whose workspace is whole, for as long as it is there; the workspace of one
/// that has gone stays in force until another's is whole. A description is judged before anything is made of
/// it. Not thread-safe. Real-time safe: no.
class WorkspaceSources {
 public:
  /// Sources at a time; what others send is refused.
  static constexpr std::size_t kMost = 3;

  /// As WorkspaceAssembler's.
  core::Status put_brick(const SourceId& source, BrickKey key, std::uint64_t version,
                         std::span<const std::uint8_t> bytes);
  /// As WorkspaceAssembler's. Refuses as well what no server sends: version 0, a version below one that the
  /// same source committed, and the same version with other content.
  core::Status commit(const SourceId& source, const VersionDescription& description);
  /// The source has ended, or is not heard of any more.
  void gone(const SourceId& source);
  /// As WorkspaceAssembler's, for the source in force.
  void prepare();

  /// The newest whole version of the source in force; null before the first.
  const std::shared_ptr<const Workspace>& current() const;
  /// Greatest μ of any layer or guard voxel in current(), Pa·s/m; 0 if there are none.
  double greatest_neighbour_mu() const;
  /// The newest version that the source in force has committed, or, once that has gone, its successor. 0:
  /// none.
  std::uint64_t announced() const;
  std::optional<SourceId> in_force() const;
  /// Whether more than one source is there.
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

  std::vector<std::unique_ptr<Source>> sources_;  // in the order in which they were first heard
  Source* in_force_ = nullptr;                    // of sources_
};

}  // namespace phantom::workspace
