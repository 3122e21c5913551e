#pragma once

#include "common/core/status.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/workspace.hpp"
#include "phantom_idl/workspace.hpp"

namespace phantom::messages {

/// Convert from the topic's type; an error names the field, its value and what is allowed. Of a removed
/// object only the id is checked.
core::Expected<WorkspaceVersion> from_idl(const msg::WorkspaceVersion& message, const ArmBounds& arm = {});
core::Expected<WorkspaceBrick> from_idl(const msg::WorkspaceBrick& message, const ArmBounds& arm = {});
core::Expected<WorkspaceObject> from_idl(const msg::WorkspaceObject& message, const ArmBounds& arm = {});
core::Expected<MeshChunk> from_idl(const msg::MeshChunk& message, const ArmBounds& arm = {});
core::Expected<WorkspaceCommand> from_idl(const msg::WorkspaceCommand& message, const ArmBounds& arm = {});
core::Expected<WorkspaceReply> from_idl(const msg::WorkspaceReply& message, const ArmBounds& arm = {});
/// As from_idl(), but leaves in `command` what could be read of an invalid message, to answer it.
core::Status read(const msg::WorkspaceCommand& message, WorkspaceCommand& command);

/// Convert to the topic's type. They check only that a command's texts are not longer than the topic takes,
/// and throw core::ConfigError.
msg::WorkspaceVersion to_idl(const WorkspaceVersion& version);
msg::WorkspaceBrick to_idl(const WorkspaceBrick& brick);
msg::WorkspaceObject to_idl(const WorkspaceObject& object);
msg::MeshChunk to_idl(const MeshChunk& chunk);
msg::WorkspaceCommand to_idl(const WorkspaceCommand& command);
msg::WorkspaceReply to_idl(const WorkspaceReply& reply);

}  // namespace phantom::messages
