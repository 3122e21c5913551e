#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "common/core/joints.hpp"
#include "common/teleop/guards/loop_guard.hpp"

namespace phantom::teleop {

/// Gains of the position loop of one joint. Units of a revolute joint: N·m/rad, N·m·s/rad and N·m; of a
/// prismatic joint: N/m, N·s/m and N.
struct JointServoGains {
  double k_p = 0.0;           ///< ≥ 0
  double k_v = 0.0;           ///< ≥ 0
  double torque_limit = 0.0;  ///< bounds the whole drive torque, ≥ 0
};

/// Returns the gains that give a joint of `inertia` the closed-loop natural frequency `bandwidth_Hz` and the
/// `damping_ratio`.
JointServoGains gains_for(double inertia, double bandwidth_Hz, double damping_ratio,
                          double torque_limit) noexcept;

/// Returns the delay margin [s] of the position loop (k_v s + k_p) / (inertia s²) of a joint of `inertia` >
/// 0: the longest delay between a measurement and the torque computed from it at which the loop is still
/// stable. Friction is left out; it would add to the margin. Returns infinity where neither gain is greater
/// than 0.
double delay_margin_s(const JointServoGains& gains, double inertia) noexcept;

/// Share of a loop's delay margin that may be used: with half of it, the loop is still well damped.
inline constexpr double kUsableShareOfDelayMargin = 0.5;

/// What a joint bears while its torque acts unchanged because the loop is held up (docs/theory.md, 11).
struct HeldTorque {
  double longest_s = std::numeric_limits<double>::infinity();  ///< for so long at full gains
  double impulse = std::numeric_limits<double>::infinity();  ///< beyond it: greatest torque · time, N·m·s
};
/// Returns it for a joint of `inertia` > 0 and greatest speed `max_speed`, whose torque acts `delay_periods`
/// ticks after the measured position: gains that fall with 1/held (k_v) and 1/held² (k_p) keep the loop
/// within its share of the delay margin; the impulse keeps the joint within 1.25 of its speed until a torque
/// is off.
HeldTorque held_torque(const JointServoGains& gains, double inertia, double max_speed,
                       double delay_periods) noexcept;

struct ServoTorque {
  core::JointArray drive_Nm{};  ///< torque of the drives
  core::JointArray
      loop_Nm{};  ///< F_as: torque of the position loop alone, without gravity feed-forward (SCTFB signal)
};

/// Position loops of the slave's joints: F_as = K_p(q_ref − q) + K_v(v_ref − v), Table 5.1. Constant after
/// construction.
class JointServo {
 public:
  /// `held`: what the joints bear while the loop is held up; by default any time, as for a simulated joint.
  JointServo(std::size_t joint_count, const std::array<JointServoGains, core::kMaxJoints>& gains,
             const std::array<HeldTorque, core::kMaxJoints>& held = {})
      : count_(joint_count), gains_(gains), held_(held) {}

  /// Computes the torques of one tick. `feed_forward_Nm` is added before the torque limit (gravity of an
  /// unbalanced arm; zero if not wanted). |drive| ≤ torque limit for any input. A joint with a value that is
  /// not finite gets no torque. The longer a torque may act by `pace`, the softer are the loops. Real-time
  /// safe: yes.
  ServoTorque step(const core::JointArray& q_ref, const core::JointArray& v_ref, const core::JointArray& q,
                   const core::JointArray& v, const core::JointArray& feed_forward_Nm,
                   const LoopPace& pace = {}) const noexcept;

 private:
  std::size_t count_;
  std::array<JointServoGains, core::kMaxJoints> gains_;
  std::array<HeldTorque, core::kMaxJoints> held_;
};

/// Moves a reference towards a target at bounded speed and keeps it within the joint limits, whatever the
/// target is.
class ReferenceLimiter {
 public:
  ReferenceLimiter(std::size_t joint_count, const core::JointArray& lower, const core::JointArray& upper)
      : count_(joint_count), lower_(lower), upper_(upper) {}

  /// Sets the reference, clamped to the limits. A position that is not finite leaves its joint's reference as
  /// it is.
  void reset(const core::JointArray& q) noexcept;
  /// Moves the reference towards `target` by at most max_speed·dt per joint. A target that is not finite
  /// leaves its joint's reference as it is.
  const core::JointArray& step(const core::JointArray& target, const core::JointArray& max_speed,
                               double dt_s) noexcept;
  const core::JointArray& reference() const noexcept { return reference_; }

 private:
  std::size_t count_;
  core::JointArray lower_, upper_, reference_{};
};

}  // namespace phantom::teleop
