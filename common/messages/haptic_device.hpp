#pragma once

#include <cstdint>

#include "common/core/sample_id.hpp"
#include "common/messages/received.hpp"
#include "common/teleop/coupling/device_watch.hpp"

// The samples of the topics of idl/haptic_device.idl as components use them. Units and frames are in the IDL
// where a name does not say them. Trivially copyable, as core::Snapshot requires.

namespace phantom::messages {

/// What a haptic device is able to do. Axes: bits 0 to 2 along x, y, z of its frame, bits 3 to 5 about them.
struct HapticAbilities {
  std::uint32_t measured_axes = 0, actuated_axes = 0;
  double max_force_N = 0.0, max_moment_N_m = 0.0;
  double mass_kg = 0.0, inertia_kg_m2 = 0.0;  ///< the least that the hand finds
  double workspace_m = 0.0, workspace_rad = 0.0;
  double period_s = 0.0;

  friend bool operator==(const HapticAbilities&, const HapticAbilities&) = default;
};

inline constexpr std::uint32_t kPositionAxes = 7, kAllAxes = 63;

/// Topic haptic_device: what the hand does with a device that another process serves.
struct HapticDevice {
  core::SampleId stamp;
  core::SampleId wrench_echo;  ///< the haptic_device_wrench that acted up to this measurement
  teleop::HandleMotion handle;
  bool ready = false;  ///< its pose is true and its motors follow
  bool clutch = false;
  std::uint32_t buttons = 0;
  double grip_opening = -1.0;  ///< −1: it has no grip
  HapticAbilities able;

  friend bool operator==(const HapticDevice&, const HapticDevice&) = default;
};

/// Topic haptic_device_wrench: what the device is to exert on the hand.
struct HapticDeviceWrench {
  core::SampleId stamp;
  core::SampleId device_echo;  ///< the haptic_device from which it was computed
  Vector3 force_N{}, moment_N_m{};
  bool valid = false;  ///< this device is taken
  bool leads = false;  ///< the hand leads the tool
  double time_to_live_s = 0.02, fade_s = 0.02;

  friend bool operator==(const HapticDeviceWrench&, const HapticDeviceWrench&) = default;
};

/// Returns the share, 0…1, of a wrench that a device may still exert `age_s` after its receipt. Real-time
/// safe: yes.
inline double share_at_age(const HapticDeviceWrench& wrench, double age_s) noexcept {
  if (!(age_s >= 0.0)) return 0.0;
  if (age_s <= wrench.time_to_live_s) return 1.0;
  const double faded = (age_s - wrench.time_to_live_s) / wrench.fade_s;
  return faded < 1.0 ? 1.0 - faded : 0.0;
}

}  // namespace phantom::messages
