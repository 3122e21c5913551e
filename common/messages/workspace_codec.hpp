#pragma once

#include "common/core/status.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/workspace.hpp"
#include "phantom_idl/workspace.h"

namespace phantom::messages {

/// From the topic's type; an error names the field, its value and what is allowed. Nothing of an object that
/// was removed is looked at but its id.
core::Expected<WorkspaceObject> from_idl(const msg::WorkspaceObject& message, const ArmBounds& arm = {});
/// A pose within a message; `field`: its name there.
core::Expected<geometry::Pose> pose_of(const char* field, const msg::Pose& message);

/// To the topic's type, unchecked.
msg::WorkspaceObject to_idl(const WorkspaceObject& object);
msg::Pose to_idl(const geometry::Pose& X);

}  // namespace phantom::messages
