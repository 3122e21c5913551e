#pragma once

#include "common/core/status.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/workspace.hpp"
#include "phantom_idl/workspace.h"

namespace phantom::messages {

/// Converts from the topic's type; an error names the field, its value and what is allowed. Of a removed
/// object only the id is checked.
core::Expected<WorkspaceObject> from_idl(const msg::WorkspaceObject& message, const ArmBounds& arm = {});
/// Converts a pose within a message; `field`: its name there.
core::Expected<geometry::Pose> pose_of(const char* field, const msg::Pose& message);

/// Convert to the topic's type, without checks.
msg::WorkspaceObject to_idl(const WorkspaceObject& object);
msg::Pose to_idl(const geometry::Pose& X);

}  // namespace phantom::messages
