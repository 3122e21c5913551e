#pragma once

#include <cstddef>

#include "common/core/joints.hpp"
#include "common/robot/drag/drag.hpp"

namespace phantom::teleop {

struct TorqueSlewParameters {
  std::size_t joint_count = 0;
  robot::DragMode mode = robot::DragMode::kSeparable;
  core::JointArray percept_cap_Nm{}, feedback_cap_Nm{};  ///< ≥ 0
  core::JointArray limit_Nm{};                           ///< torque limit of the device's motors, ≥ 0
  core::JointArray rate_Nm_per_s{};                      ///< greatest rate of the whole torque, > 0
};

/// Torque of the motors and its two parts: percept + feedback = motor.
struct SlewedTorque {
  core::JointArray motor_Nm{}, percept_Nm{}, feedback_Nm{};
  /// More was asked of a joint than its cap allows, or, of the feedback, than drag leaves of the device's
  /// limit.
  bool percept_capped = false, feedback_capped = false;
};

/// Limits the rate of change of the torque. It is the last stage before the device, whatever the torque's
/// source.
///
/// Each part moves towards its requested value at its share of the rate. The shares are in proportion to the
/// caps, so that from zero both parts reach their caps at the same time. For any input, NaN and infinity
/// included, at every step:
/// 1. |motor| ≤ the device's limit; |percept| and |feedback| ≤ their caps.
/// 2. The percept's power is never positive: with separable drag on no joint, with coupled drag in the sum.
///    When the hand turns round within a few milliseconds, the bounded rate alone would leave drag that
///    pushes. Such drag falls to zero at once: passivity takes precedence over smoothness, and a torque that
///    vanishes does not push. With coupled drag, the torques of the pushing joints fall only as far as the
///    sum requires.
/// 3. Each part changes by at most its share of rate·dt, apart from that fall. So the motor's torque changes
///    by at most rate·dt plus the fall.
/// A requested value that is not finite counts as zero. Real-time safe: yes.
class TorqueSlew {
 public:
  explicit TorqueSlew(const TorqueSlewParameters& parameters);

  /// `velocity`: the master's velocity of the present tick, rad/s or m/s.
  const SlewedTorque& step(const core::JointArray& percept_Nm, const core::JointArray& feedback_Nm,
                           const core::JointArray& velocity, double dt_s) noexcept;

 private:
  void let_go(const core::JointArray& velocity) noexcept;

  TorqueSlewParameters parameters_;
  core::JointArray percept_rate_{}, feedback_rate_{};
  core::JointArray feedback_Nm_{};  // before the device's limit
  SlewedTorque now_;
};

}  // namespace phantom::teleop
