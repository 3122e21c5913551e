#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <vector>

#include "common/messages/workspace.hpp"
#include "common/workspace/workspace_sources.hpp"

namespace phantom::messages {

/// Keeps apart the objects that different servers announce, and says whose are in force: those of the server
/// that was first to commit a version, for as long as it is present; before any has, those of the server that
/// was heard first. After the server in force has gone, its objects stay in force until another has committed
/// a version; that server's objects then take their place, all at once. Objects of others are kept meanwhile,
/// as samples of a successor come only once. Bounded in memory. Not thread-safe. Real-time safe: no.
class ObjectSources {
 public:
  using Objects = std::map<std::uint16_t, WorkspaceObject>;  ///< by id
  /// Greatest number of servers at a time; samples of further ones are refused.
  static constexpr std::size_t kMax = workspace::WorkspaceSources::kMax;
  /// Beside the server in force one may announce twice as many objects, and at least so many.
  static constexpr std::size_t kMinObjects = 4096;

  /// The result of one sample.
  struct Taken {
    bool accepted = false;  ///< else there is no room for what it announces
    /// What becomes different among the objects in force, in order: objects that are new or moved, and
    /// removed ones.
    std::vector<WorkspaceObject> changes;
  };

  /// Takes an object's newest state.
  Taken take(const workspace::SourceId& server, const WorkspaceObject& object);
  /// Takes a version that a server commits. `accepted`: that server is in force.
  Taken commit(const workspace::SourceId& server, WorkspaceVersion version = {});
  /// Reports that a server has ended or is no longer heard; returns the changes.
  std::vector<WorkspaceObject> gone(const workspace::SourceId& server);

  /// Returns the version in force, which says what arms carry: the newest of the server whose objects are;
  /// none: it has committed none. It may become another one by take(), commit() and gone() alike.
  const std::optional<WorkspaceVersion>& version() const;
  /// Returns what arms carry in that version.
  const std::vector<CarriedObject>& carried() const;
  /// Returns the server in force; none: no version is.
  std::optional<workspace::SourceId> server() const;
  /// Returns the objects in force.
  const Objects& in_force() const;
  /// Returns the objects of a server, or those in force if that server is unknown.
  const Objects& of(const workspace::SourceId& server) const;

 private:
  struct Source {
    workspace::SourceId server;
    Objects objects = {};
    std::optional<WorkspaceVersion> version = {};  // its newest; none: it has committed none
    bool gone = false;
  };
  Source* find_or_add(const workspace::SourceId& server);
  std::vector<WorkspaceObject> choose();

  std::vector<Source> sources_;  // the first is in force
};

}  // namespace phantom::messages
