#pragma once

#include "common/core/status.hpp"
#include "common/messages/arm_bounds.hpp"
#include "common/messages/haptic_device.hpp"
#include "phantom_idl/haptic_device.hpp"

namespace phantom::messages {

/// Convert from the topic's type, as those of teleoperation_codec.hpp. A device is of no arm.
core::Expected<HapticDevice> from_idl(const msg::HapticDevice& message, const ArmBounds& arm = {});
core::Expected<HapticDeviceWrench> from_idl(const msg::HapticDeviceWrench& message,
                                            const ArmBounds& arm = {});
/// Convert to the topic's type, without checks; the writer completes the stamp.
msg::HapticDevice to_idl(const HapticDevice& state);
msg::HapticDeviceWrench to_idl(const HapticDeviceWrench& wrench);

}  // namespace phantom::messages
