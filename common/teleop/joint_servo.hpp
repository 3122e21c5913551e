#pragma once

#include <array>
#include <cstddef>

#include "common/core/joints.hpp"

namespace phantom::teleop {

/// Position loop of one joint. Units by type: N·m/rad, N·m·s/rad, N·m, rad/s; or N/m, N·s/m, N, m/s.
struct JointServoGains {
  double k_p = 0.0;           ///< ≥ 0
  double k_v = 0.0;           ///< ≥ 0
  double torque_limit = 0.0;  ///< ≥ 0, of the whole drive torque
};

/// Gains that give a joint of `inertia` the closed-loop natural frequency `bandwidth_Hz` and `damping_ratio`.
JointServoGains gains_for(double inertia, double bandwidth_Hz, double damping_ratio,
                          double torque_limit) noexcept;

/// Longest time [s] that may pass from a measurement to the torque that answers it before the position loop
/// of a joint of `inertia` > 0 swings by itself: the delay margin of (k_v s + k_p) / (inertia s²). Friction,
/// which would add to it, is left out. Infinite where neither gain is greater than 0.
double delay_margin_s(const JointServoGains& gains, double inertia) noexcept;

struct ServoTorque {
  core::JointArray drive_Nm{};  ///< what the drives exert
  core::JointArray
      loop_Nm{};  ///< F_as: its part due to the position loop, without gravity feed-forward (SCTFB signal)
};

/// Slave position loops: F_as = K_p(q_ref − q) + K_v(v_ref − v), Table 5.1. Constant after construction.
class JointServo {
 public:
  JointServo(std::size_t joint_count, const std::array<JointServoGains, core::kMaxJoints>& gains)
      : count_(joint_count), gains_(gains) {}

  /// `feed_forward_Nm` is added before the torque limit (gravity of an unbalanced arm; zero if not wanted).
  /// |drive| ≤ torque limit for any input; a joint with a value that is not finite gets no torque. Real-time
  /// safe: yes.
  ServoTorque step(const core::JointArray& q_ref, const core::JointArray& v_ref, const core::JointArray& q,
                   const core::JointArray& v, const core::JointArray& feed_forward_Nm) const noexcept;

 private:
  std::size_t count_;
  std::array<JointServoGains, core::kMaxJoints> gains_;
};

/// Leads a reference to a target at bounded speed and within limits, whatever the target is.
class ReferenceLimiter {
 public:
  ReferenceLimiter(std::size_t joint_count, const core::JointArray& lower, const core::JointArray& upper)
      : count_(joint_count), lower_(lower), upper_(upper) {}

  /// Sets the reference; held to the limits.
  void reset(const core::JointArray& q) noexcept;
  /// Moves the reference towards `target` by at most max_speed·dt per joint; values that are not finite leave
  /// it.
  const core::JointArray& step(const core::JointArray& target, const core::JointArray& max_speed,
                               double dt_s) noexcept;
  const core::JointArray& reference() const noexcept { return reference_; }

 private:
  std::size_t count_;
  core::JointArray lower_, upper_, reference_{};
};

}  // namespace phantom::teleop
