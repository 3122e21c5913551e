#pragma once

#include <functional>
#include <optional>
#include <string>

#include "common/core/network.hpp"
#include "common/messages/percept.hpp"
#include "common/messages/workspace.hpp"

namespace phantom::messages {

/// Send one command to the running phantom_sensing or wva_server, repeatedly until it is answered, and return
/// the final reply; none if that does not come within `timeout_s`. `name`: of the participant that asks, also
/// for the other component's log. `on_accepted`: called for each reply before the final one. Throw DdsError,
/// and core::ConfigError for a text that is too long for the topic.
std::optional<SensingReply> ask(const core::NetworkOptions& network, const std::string& name,
                                SensingCommand command, double timeout_s);
std::optional<WorkspaceReply> ask(const core::NetworkOptions& network, const std::string& name,
                                  WorkspaceCommand command, double timeout_s,
                                  const std::function<void(const WorkspaceReply&)>& on_accepted = {});

}  // namespace phantom::messages
