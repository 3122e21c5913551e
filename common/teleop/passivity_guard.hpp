#pragma once

#include <cstddef>

#include "common/core/joints.hpp"

namespace phantom::teleop {

struct PassivityParameters {
  std::size_t joint_count = 0;
  bool enabled = true;
  /// Energy that a joint's feedback may give the hand beyond what it took from it: the weight of an unbalanced arm
  /// and a spring that was wound up before coupling need some. J, ≥ 0.
  core::JointArray allowance_J{};
  /// What it may save up from energy taken, J, ≥ 0: bounds how long an active feedback stays unnoticed.
  core::JointArray store_J{};
  /// Greatest damping that the guard may add, N·m·s/rad or N·s/m: what the device still renders stably.
  core::JointArray damping_limit{};
};

/// Passivity observer and controller (Hannaford and Ryu 2002) on the feedback of the slave, joint by joint: delay,
/// sampling and a stiff environment can make the loop through the network give the hand energy that nobody put in.
///
/// The observer adds up what the feedback took from the hand over each period, exactly for a torque that is held
/// between samples: −τ(k−1)·(q(k) − q(k−1)). When the sum falls below −allowance, the controller adds −α·v with the
/// least α that would win the deficit back within the next period, at most the damping limit. The sum is kept at
/// store_J at most.
class PassivityGuard {
 public:
  explicit PassivityGuard(const PassivityParameters& parameters) : parameters_(parameters) {}

  /// The torque to render instead of `torque_Nm` at the device's position and velocity. Values that are not finite
  /// are taken as no torque. Real-time safe: yes.
  core::JointArray step(const core::JointArray& torque_Nm, const core::JointArray& position,
                        const core::JointArray& velocity, double dt_s) noexcept;

  /// Whether damping was added in the last step.
  bool active() const noexcept { return active_; }
  /// Energy balance of a joint, J: > 0 taken from the hand, < 0 given to it.
  double energy_J(std::size_t joint) const noexcept { return energy_J_[joint]; }

 private:
  PassivityParameters parameters_;
  core::JointArray energy_J_{}, last_torque_Nm_{}, last_position_{};
  bool started_ = false, active_ = false;
};

}  // namespace phantom::teleop
