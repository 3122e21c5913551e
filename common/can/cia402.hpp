#pragma once

#include <cstdint>

namespace phantom::can {

/// States of a drive's power stage (CiA 402, figure "PDS FSA").
enum class PowerState : std::uint8_t {
  kNotReady,
  kSwitchOnDisabled,
  kReadyToSwitchOn,
  kSwitchedOn,
  kOperationEnabled,
  kQuickStopActive,
  kFaultReaction,
  kFault,
};

constexpr PowerState power_state(std::uint16_t statusword) noexcept {
  switch (statusword & 0x4F) {
    case 0x40:
      return PowerState::kSwitchOnDisabled;
    case 0x0F:
      return PowerState::kFaultReaction;
    case 0x08:
      return PowerState::kFault;
    default:
      break;
  }
  switch (statusword & 0x6F) {
    case 0x21:
      return PowerState::kReadyToSwitchOn;
    case 0x23:
      return PowerState::kSwitchedOn;
    case 0x27:
      return PowerState::kOperationEnabled;
    case 0x07:
      return PowerState::kQuickStopActive;
    default:
      return PowerState::kNotReady;
  }
}

/// Bit of the statusword, in position mode.
inline constexpr std::uint16_t kFollowingErrorBit = 0x2000;

/// Homing mode: its number, bits of the statusword, and the bit of the controlword that starts it.
inline constexpr std::int8_t kHomingMode = 6;
inline constexpr std::uint16_t kHomingAttained = 0x1000, kTargetReached = 0x0400, kHomingErrorBit = 0x2000,
                               kStartHoming = 0x0010;

/// Commands of the controlword.
inline constexpr std::uint16_t kCommandDisableVoltage = 0x00, kCommandQuickStop = 0x02,
                               kCommandShutdown = 0x06, kCommandSwitchOn = 0x07,
                               kCommandEnableOperation = 0x0F, kCommandFaultReset = 0x80;

/// Returns the controlword that leads from `state` one step towards operation enabled. It never resets a
/// fault.
constexpr std::uint16_t towards_enabled(PowerState state) noexcept {
  switch (state) {
    case PowerState::kSwitchOnDisabled:
      return kCommandShutdown;
    case PowerState::kReadyToSwitchOn:
      return kCommandSwitchOn;
    case PowerState::kSwitchedOn:
    case PowerState::kOperationEnabled:
    case PowerState::kQuickStopActive:
      return kCommandEnableOperation;
    default:
      return kCommandDisableVoltage;
  }
}

}  // namespace phantom::can
