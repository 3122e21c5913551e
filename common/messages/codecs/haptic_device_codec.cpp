#include "common/messages/codecs/haptic_device_codec.hpp"

#include "common/messages/codecs/fields_codec.hpp"

namespace phantom::messages {
namespace {

constexpr double kFarthestHandle_m = 10.0, kFastestHandle_m_s = 10.0, kFastestHandle_rad_s = 100.0;
constexpr double kMaxForce_N = 1000.0, kMaxMoment_N_m = 100.0;

constexpr auto kHapticDevice = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.echo(m.wrench_echo(), s.wrench_echo);
  codec.placement("X_DH", m.X_DH(), s.handle.position_m, s.handle.R_DH, kFarthestHandle_m);
  codec.vector("velocity_m_s", m.velocity_m_s(), s.handle.velocity_m_s, kFastestHandle_m_s);
  codec.vector("angular_velocity_rad_s", m.angular_velocity_rad_s(), s.handle.angular_velocity_rad_s,
               kFastestHandle_rad_s);
  codec.any(m.ready(), s.ready);
  codec.any(m.clutch(), s.clutch);
  codec.any(m.buttons(), s.buttons);
  codec.number("grip_opening", m.grip_opening(), s.grip_opening, -1.0, 1.0);
  codec.number("measured_axes", m.measured_axes(), s.able.measured_axes, kPositionAxes, kAllAxes);
  codec.number("actuated_axes", m.actuated_axes(), s.able.actuated_axes, 0.0, kAllAxes);
  codec.number("max_force_N", m.max_force_N(), s.able.max_force_N, 0.0, kMaxForce_N);
  codec.number("max_moment_N_m", m.max_moment_N_m(), s.able.max_moment_N_m, 0.0, kMaxMoment_N_m);
  codec.number("mass_kg", m.mass_kg(), s.able.mass_kg, 1e-3, 100.0);
  codec.number("inertia_kg_m2", m.inertia_kg_m2(), s.able.inertia_kg_m2, 1e-6, 10.0);
  codec.number("workspace_m", m.workspace_m(), s.able.workspace_m, 1e-3, 10.0);
  codec.number("workspace_rad", m.workspace_rad(), s.able.workspace_rad, 0.0, 10.0);
  codec.number("period_s", m.period_s(), s.able.period_s, 0.00025, 0.004);
};

constexpr auto kHapticDeviceWrench = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.echo(m.device_echo(), s.device_echo);
  codec.vector("force_N", m.force_N(), s.force_N, kMaxForce_N);
  codec.vector("moment_N_m", m.moment_N_m(), s.moment_N_m, kMaxMoment_N_m);
  codec.any(m.valid(), s.valid);
  codec.any(m.leads(), s.leads);
  codec.number("time_to_live_s", m.time_to_live_s(), s.time_to_live_s, 0.001, 1.0);
  codec.number("fade_s", m.fade_s(), s.fade_s, 0.001, 1.0);
};

}  // namespace

core::Expected<HapticDevice> from_idl(const msg::HapticDevice& message, const ArmBounds& arm) {
  auto state = decoded<HapticDevice>(kHapticDevice, message, arm);
  if (state && state->able.measured_axes != kPositionAxes && state->able.measured_axes != kAllAxes) {
    return core::Status::invalid_argument("measured_axes is " + std::to_string(state->able.measured_axes) +
                                          "; allowed: 7 (position) or 63 (and orientation)");
  }
  if (state && state->grip_opening < 0.0 && state->grip_opening != -1.0)
    return core::Status::invalid_argument("grip_opening is negative; allowed: 0 to 1, or -1 (it has none)");
  return state;
}
core::Expected<HapticDeviceWrench> from_idl(const msg::HapticDeviceWrench& message, const ArmBounds& arm) {
  return decoded<HapticDeviceWrench>(kHapticDeviceWrench, message, arm);
}
msg::HapticDevice to_idl(const HapticDevice& state) {
  return encoded<msg::HapticDevice>(kHapticDevice, state);
}
msg::HapticDeviceWrench to_idl(const HapticDeviceWrench& wrench) {
  return encoded<msg::HapticDeviceWrench>(kHapticDeviceWrench, wrench);
}

}  // namespace phantom::messages
