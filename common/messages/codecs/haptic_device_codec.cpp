#include "common/messages/codecs/haptic_device_codec.hpp"

#include "common/messages/codecs/fields_codec.hpp"

namespace phantom::messages {
namespace {

#include "phantom_contract/haptic_device_fields.inc"

/// Returns why the device's fields do not fit together; empty if they do.
std::string refusal(const HapticDevice& device) {
  const std::uint32_t axes = device.able.measured_axes;
  if (axes != kPositionAxes && axes != kAllAxes)
    return "measured_axes is " + std::to_string(axes) + "; allowed: 7 (position) or 63 (and orientation)";
  if (device.grip_opening < 0.0 && device.grip_opening != -1.0)
    return "grip_opening is negative; allowed: 0 to 1, or -1 (it has none)";
  return "";
}

}  // namespace

#include "phantom_contract/haptic_device_codec.inc"

}  // namespace phantom::messages
