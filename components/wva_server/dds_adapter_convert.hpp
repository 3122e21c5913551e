#pragma once

// Conversion between topic types and what the component works with. Part of the DDS adapter: nothing else
// sees idl.

#include <string>

#include "common/dds/stamp.hpp"
#include "common/dds/topics.hpp"
#include "common/messages/workspace_codec.hpp"
#include "common/workspace/workspace_assembler.hpp"
#include "components/wva_server/cell_request.hpp"

namespace phantom::wva_server {

/// The version that commits `workspace`, whose content hash is `hash`.
msg::WorkspaceVersion version_message(const std::string& cell, const workspace::Workspace& workspace,
                                      std::uint64_t hash);

/// Why a command cannot be used, naming the field and what is allowed; empty if it can.
std::string refusal(const msg::WorkspaceCommand& message);
/// Of a message without refusal; of one with, only who asked for what.
Request to_request(const msg::WorkspaceCommand& message);
/// All but the stamp.
msg::WorkspaceCommand to_message(const CellCommand& command, const std::string& requester);
/// All but stamp and echo.
msg::WorkspaceReply to_message(const Request& request, const Reply& reply);
Reply to_reply(const msg::WorkspaceReply& message);

}  // namespace phantom::wva_server
