#pragma once

#include <cstddef>

#include "common/core/joints.hpp"

namespace phantom::teleop {

struct PassivityParameters {
  std::size_t joint_count = 0;
  bool enabled = true;
  /// Energy that a joint's feedback may give the hand beyond what it took from it: the weight of an
  /// unbalanced arm and a spring that was wound up before coupling need some. J, ≥ 0.
  core::JointArray allowance_J{};
  /// What it may save up from energy taken, J, ≥ 0: bounds how long an active feedback stays unnoticed.
  core::JointArray store_J{};
  /// Greatest damping that the guard may add, N·m·s/rad or N·s/m: what the device still renders stably.
  core::JointArray damping_limit{};
};

/// Passivity observer and controller (Hannaford and Ryu 2002) on the feedback of the slave, joint by joint:
/// delay, sampling and a stiff environment can make the loop through the network give the hand energy that
/// nobody put in.
///
/// The observer adds up what the feedback took from the hand over each period, exactly for a torque that is
/// held between samples: −τ(k−1)·(q(k) − q(k−1)). When the sum falls below −allowance, the controller adds
/// −α·v; α goes towards what would win the deficit back within the next period, at most the damping limit,
/// over kEngage_s, and away over kRelease_s, so that the guard itself is no kick. The sum is kept at store_J
/// at most.
class PassivityGuard {
 public:
  explicit PassivityGuard(const PassivityParameters& parameters) : parameters_(parameters) {}

  static constexpr double kEngage_s = 0.01, kRelease_s = 0.1;

  /// The torque to render instead of `torque_Nm` at the device's position and velocity. Values that are not
  /// finite are taken as no torque. `authority` 0…1 scales the damping; at 0 the balance begins anew.
  /// Real-time safe: yes.
  core::JointArray step(const core::JointArray& torque_Nm, const core::JointArray& position,
                        const core::JointArray& velocity, double authority, double dt_s) noexcept;

  /// What the device got in the end instead of step()'s torque (a cap, a bounded rate): the balance is of
  /// that. Real-time safe: yes.
  void note_rendered(const core::JointArray& torque_Nm) noexcept;

  /// Whether damping was added in the last step.
  bool active() const noexcept { return active_; }
  /// Energy balance of a joint, J: > 0 taken from the hand, < 0 given to it.
  double energy_J(std::size_t joint) const noexcept { return energy_J_[joint]; }

 private:
  double damping_for(std::size_t joint, double velocity, double dt_s) noexcept;

  PassivityParameters parameters_;
  core::JointArray energy_J_{}, damping_{}, last_torque_Nm_{}, last_position_{};
  bool started_ = false, active_ = false;
};

}  // namespace phantom::teleop
