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

/// What a running wva_server serves.
struct Listing {
  std::string cell;
  std::uint64_t version = 0;
  std::uint32_t bricks = 0;
  std::vector<messages::WorkspaceObject> objects;
};

/// The other end of workspace_command: for who asks for a change. One thread.
class CommandClient {
 public:
  /// Joins the data space. Throws dds::DdsError.
  explicit CommandClient(const core::NetworkOptions& network);
  ~CommandClient();

  /// Sends the command, again and again until it is answered, and waits for the last word: done or refused.
  /// None if there was no word for `timeout_s`. `on_accepted` hears what is said in between. Throws
  /// core::ConfigError for a command that does not fit the topic.
  std::optional<Reply> ask(const CellCommand& command, double timeout_s,
                           const std::function<void(const Reply&)>& on_accepted);
  /// What is served, once it is known whole; none if it is not within `timeout_s`.
  std::optional<Listing> list(double timeout_s);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::wva_server
