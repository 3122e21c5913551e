#pragma once

// Conversion between topic types and the component's own types. Part of the DDS adapter: no other part of the
// component uses IDL types.

#include <string>

#include "common/dds/stamp.hpp"
#include "common/dds/topics.hpp"
#include "common/messages/workspace_codec.hpp"
#include "common/workspace/workspace_assembler.hpp"
#include "components/wva_server/cell_request.hpp"

namespace phantom::wva_server {

/// Returns the version that commits `workspace`, whose content hash is `hash`.
msg::WorkspaceVersion version_message(const std::string& cell, const workspace::Workspace& workspace,
                                      std::uint64_t hash);

/// Returns why a command cannot be used, naming the field and what is allowed; empty if it can be used.
std::string refusal(const msg::WorkspaceCommand& message);
/// Converts a command. If refusal() is not empty, only the requester and the kind of request are meaningful.
Request to_request(const msg::WorkspaceCommand& message);
/// Converts everything but the stamp.
msg::WorkspaceCommand to_message(const CellCommand& command, const std::string& requester);
/// Converts everything but stamp and echo.
msg::WorkspaceReply to_message(const Request& request, const Reply& reply);
Reply to_reply(const msg::WorkspaceReply& message);

}  // namespace phantom::wva_server
