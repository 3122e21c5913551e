#pragma once

#include <cstddef>

#include "common/core/joints.hpp"

namespace phantom::teleop {

struct PassivityParameters {
  std::size_t joint_count = 0;
  bool enabled = true;
  /// Energy that the feedback of a joint may give to the hand beyond what it took, J, ≥ 0. The weight of an
  /// unbalanced arm and a spring that was loaded before coupling need some.
  core::JointArray allowance_J{};
  /// Greatest energy balance that a joint may save up, J, ≥ 0. It bounds how long an active feedback goes
  /// unnoticed.
  core::JointArray store_J{};
  /// Greatest damping that the guard may add, N·m·s/rad or N·s/m: the most that the device renders stably.
  core::JointArray damping_limit{};
};

/// Passivity observer and controller (Hannaford and Ryu 2002) on the slave's feedback, joint by joint. It is
/// needed because delay, sampling and a stiff environment can make the loop through the network generate
/// energy.
///
/// The observer adds up the energy that the feedback takes from the hand in each period. The sum is exact for
/// a torque that is held between samples: −τ(k−1)·(q(k) − q(k−1)). When the sum falls below −allowance, the
/// controller adds −α·v. α moves towards the damping that would remove the deficit within the next period, at
/// most the damping limit. α rises over kEngage_s and falls over kRelease_s, so that the guard itself causes
/// no jolt. The sum is kept at store_J at most.
class PassivityGuard {
 public:
  explicit PassivityGuard(const PassivityParameters& parameters) : parameters_(parameters) {}

  static constexpr double kEngage_s = 0.01, kRelease_s = 0.1;

  /// Returns the torque to render instead of `torque_Nm` at the device's position and velocity. Torques that
  /// are not finite count as zero. `authority` 0…1 scales the damping; at 0 the energy balance starts anew.
  /// Real-time safe: yes.
  core::JointArray step(const core::JointArray& torque_Nm, const core::JointArray& position,
                        const core::JointArray& velocity, double authority, double dt_s) noexcept;

  /// Records the torque that the device received in the end instead of step()'s, after caps and slew limits;
  /// the energy balance is computed with it. Real-time safe: yes.
  void note_rendered(const core::JointArray& torque_Nm) noexcept;
  /// Records that the device rendered only `share`, 0…1, of the torque recorded last. Real-time safe: yes.
  void note_share(double share) noexcept;

  /// Whether damping was added in the last step.
  bool active() const noexcept { return active_; }
  /// Returns the energy balance of a joint, J: > 0 was taken from the hand, < 0 was given to it.
  double energy_J(std::size_t joint) const noexcept { return energy_J_[joint]; }

 private:
  double damping_for(std::size_t joint, double velocity, double dt_s) noexcept;

  PassivityParameters parameters_;
  core::JointArray energy_J_{}, damping_{}, last_torque_Nm_{}, last_position_{};
  bool started_ = false, active_ = false;
};

}  // namespace phantom::teleop
