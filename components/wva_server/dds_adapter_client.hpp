#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/core/network.hpp"
#include "common/messages/workspace.hpp"
#include "components/wva_server/cell_request.hpp"

namespace phantom::wva_server {

/// The cell and the objects that a running wva_server serves.
struct Listing {
  std::string cell;
  std::uint64_t version = 0;
  std::uint32_t bricks = 0;
  std::vector<messages::WorkspaceObject> objects;
};

/// The requester's end of workspace_command. One thread.
class CommandClient {
 public:
  /// Joins the data space. Throws dds::DdsError.
  explicit CommandClient(const core::NetworkOptions& network);
  ~CommandClient();

  /// Sends the command repeatedly until it is answered, and waits for the final reply: done or refused.
  /// Returns none if no new reply comes for `timeout_s`. Calls `on_accepted` for each reply before
  /// that. Throws core::ConfigError for a command that does not fit the topic.
  std::optional<Reply> ask(const CellCommand& command, double timeout_s,
                           const std::function<void(const Reply&)>& on_accepted);
  /// Returns what is served, once all of it has been received; none if that takes longer than `timeout_s`.
  std::optional<Listing> list(double timeout_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::wva_server
