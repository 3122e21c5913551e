#pragma once

#include <memory>
#include <optional>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "components/wva_server/cell_request.hpp"

namespace phantom::wva_server {

/// The component's ends in the data space: workspace_brick, workspace_version, workspace_object, mesh_chunk,
/// workspace_reply and component_status out, workspace_command in, and workspace_version, to notice another
/// server. What was published stays with the writers, so that late joiners get all of it. One thread.
class DdsAdapter {
 public:
  /// `accept_commands`: else every command is refused. Throws dds::DdsError.
  DdsAdapter(const core::NetworkOptions& network, bool accept_commands);
  ~DdsAdapter();

  /// An object that is new or stands elsewhere, and its mesh if no object had that before.
  void publish_object(const ServedObject& object, std::size_t chunk_bytes);
  /// Says that an object is gone. Its mesh stays, for objects that may be added with it.
  void withdraw_object(std::uint16_t id);
  /// What a change made of the workspace: changed bricks, removed ones, then the version that commits them.
  /// Bricks are compressed on `threads` threads.
  void publish_change(const LiveCell& cell, const layers::WorkspaceChange& change, int threads);
  /// Whether another process publishes a workspace here, too: consumers keep to the first. Thread-safe.
  bool has_rival() const;
  /// Publishes component_status, degraded while there is another server.
  void report(const core::Health& health);

  /// The next command, waiting for one at most `wait_s`. Each was told that it is accepted, and waits for
  /// reply().
  std::optional<Request> next_command(double wait_s);
  void reply(const Request& request, const Reply& reply);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::wva_server
