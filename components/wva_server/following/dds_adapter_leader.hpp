#pragma once

#include <memory>
#include <optional>
#include <string>

#include "common/core/network.hpp"
#include "components/wva_server/following/following.hpp"

namespace phantom::wva_server {

/// The topics of the server that this one follows, in that server's partition: workspace_version,
/// workspace_object, object_uncertainty and mesh_chunk. If several servers send there, the one in force
/// counts (messages::ObjectSources). Methods are for one thread.
class LeaderAdapter {
 public:
  /// `network`: this server's; `partition`: the leader's. Throws dds::DdsError.
  LeaderAdapter(core::NetworkOptions network, const std::string& partition);
  ~LeaderAdapter();

  /// Returns the leader's objects once it has committed a version; none before, or since nothing changed.
  std::optional<LeaderObjects> take();
  /// Returns whether a leader has been heard.
  bool is_heard() const;
  /// Returns a mesh of the leader's; null: it is not whole yet.
  const geometry::TriangleMesh* mesh(std::uint64_t hash) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::wva_server
