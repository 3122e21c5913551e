#pragma once

#include <cstddef>

#include "common/core/joints.hpp"
#include "common/robot/drag.hpp"

namespace phantom::teleop {

struct TorqueSlewParameters {
  std::size_t joint_count = 0;
  robot::DragMode mode = robot::DragMode::kSeparable;
  core::JointArray percept_cap_Nm{}, feedback_cap_Nm{};  ///< ≥ 0
  core::JointArray limit_Nm{};                           ///< of the device's motors, ≥ 0
  core::JointArray rate_Nm_per_s{};                      ///< of the whole torque, > 0
};

/// What the motors get, and its two parts; percept + feedback = motor.
struct SlewedTorque {
  core::JointArray motor_Nm{}, percept_Nm{}, feedback_Nm{};
};

/// The last stage before the device: whatever the torque's source, it changes at a bounded rate.
///
/// Each part moves towards what was asked for at its share of the rate (the caps' proportion, so that from
/// nothing both reach their caps at the same time). For any input, numbers that are none included, at every
/// step:
/// 1. |motor| ≤ the device's limit; |percept| and |feedback| ≤ their caps.
/// 2. The percept's power is never positive: separable, on no joint; coupled, in sum. Where the rate alone
///    would let drag go on that has become a push (the hand has turned round within a few milliseconds), it
///    falls to zero at once: passivity goes before smoothness, and letting go pushes nobody. Coupled, what
///    pushes falls as far as the sum asks.
/// 3. Each part's step is at most its share of rate·dt, but for that fall; so the motor's step is at most
///    rate·dt and what fell.
/// A part that is asked for and is no number counts as none. Real-time safe: yes.
class TorqueSlew {
 public:
  explicit TorqueSlew(const TorqueSlewParameters& parameters);

  /// `velocity`: the master's, of this very tick, rad/s or m/s.
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
