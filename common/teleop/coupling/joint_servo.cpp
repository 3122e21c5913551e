#include "common/teleop/coupling/joint_servo.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace phantom::teleop {

JointServoGains gains_for(double inertia, double bandwidth_Hz, double damping_ratio,
                          double torque_limit) noexcept {
  const double omega_rad_s = 2.0 * std::numbers::pi * bandwidth_Hz;
  return {inertia * omega_rad_s * omega_rad_s, 2.0 * damping_ratio * inertia * omega_rad_s, torque_limit};
}

double delay_margin_s(const JointServoGains& gains, double inertia) noexcept {
  const double damping = gains.k_v / inertia, stiffness = gains.k_p / inertia;
  if (damping <= 0.0 && stiffness <= 0.0) return std::numeric_limits<double>::infinity();
  // Where the open loop's gain is 1, its phase is atan(damping·ω / stiffness) above −180°.
  const double square = damping * damping;
  const double omega_rad_s = std::sqrt((square + std::hypot(square, 2.0 * stiffness)) / 2.0);
  return std::atan2(damping * omega_rad_s, stiffness) / omega_rad_s;
}

HeldTorque held_torque(const JointServoGains& gains, double inertia, double max_speed,
                       double delay_periods) noexcept {
  constexpr double kOverspeed = 0.25;  // beyond the greatest speed, as a share of it
  // A joint that passes its greatest speed just after it was measured keeps the torque for half a tick more
  // than the delay, which counts from a measurement to the middle of the time that the torque acts.
  return {kUsableShareOfDelayMargin * delay_margin_s(gains, inertia) / delay_periods,
          kOverspeed * inertia * max_speed / (delay_periods + 0.5)};
}

ServoTorque JointServo::step(const core::JointArray& q_ref, const core::JointArray& v_ref,
                             const core::JointArray& q, const core::JointArray& v,
                             const core::JointArray& feed_forward_Nm, const LoopPace& pace) const noexcept {
  ServoTorque torque;
  for (std::size_t j = 0; j < count_; ++j) {
    const auto& g = gains_[j];
    const double share = pace.share_within(held_[j].longest_s);
    const double softened = share * (share * g.k_p * (q_ref[j] - q[j]) + g.k_v * (v_ref[j] - v[j]));
    if (!std::isfinite(softened)) continue;
    const double bearable =
        share < 1.0 ? held_[j].impulse / pace.held_s : std::numeric_limits<double>::infinity();
    const double loop = std::clamp(softened, -bearable, bearable);
    const double drive = loop + feed_forward_Nm[j];
    if (!std::isfinite(drive)) continue;
    torque.drive_Nm[j] = std::clamp(drive, -g.torque_limit, g.torque_limit);
    torque.loop_Nm[j] = std::clamp(loop, -g.torque_limit, g.torque_limit);
  }
  return torque;
}

void ReferenceLimiter::reset(const core::JointArray& q) noexcept {
  for (std::size_t j = 0; j < count_; ++j) {
    if (std::isfinite(q[j])) reference_[j] = std::clamp(q[j], lower_[j], upper_[j]);
  }
}

const core::JointArray& ReferenceLimiter::step(const core::JointArray& target,
                                               const core::JointArray& max_speed, double dt_s) noexcept {
  for (std::size_t j = 0; j < count_; ++j) {
    if (!std::isfinite(target[j])) continue;
    const double furthest = max_speed[j] * dt_s;
    const double change = std::clamp(target[j], lower_[j], upper_[j]) - reference_[j];
    reference_[j] += std::clamp(change, -furthest, furthest);
  }
  return reference_;
}

}  // namespace phantom::teleop
