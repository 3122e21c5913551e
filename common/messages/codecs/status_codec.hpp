#pragma once

#include "common/core/status.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/status.hpp"
#include "phantom_idl/status.hpp"

namespace phantom::messages {

/// Converts from the topic's type; an error names the field, its value and what is allowed.
core::Expected<ComponentStatus> from_idl(const msg::ComponentStatus& message, const ArmBounds& arm = {});
/// Converts to the topic's type, without checks; leaves out loops, topics and figures beyond the number that
/// the topic takes.
msg::ComponentStatus to_idl(const ComponentStatus& status);

}  // namespace phantom::messages
