#pragma once

#include <array>
#include <cstddef>

#include "common/core/joints.hpp"

namespace phantom::teleop {

struct ContactForceLimitParameters {
  std::size_t joint_count = 0;
  core::JointArray torque_Nm{};    ///< bound of each joint's external torque, N·m or N; 0: none
  double tool_force_N = 0.0;       ///< bound of the force at the tool; 0: none
  core::JointArray yield_speed{};  ///< at which a joint's reference yields and comes back, rad/s or m/s, > 0
};

/// Force on the arm as it is known at a tick.
struct ContactForce {
  bool measured = false;
  core::JointArray external_Nm{};  ///< torques that the surroundings exert on the joints (F_e)
  double tool_force_N = 0.0;       ///< at the tool, by those torques; 0: unknown
  double object_force_N = 0.0;     ///< on the object that is touched; 0: unknown
  double object_bound_N = 0.0;     ///< that this object bears; 0: any
};

/// Bounds the force with which the arm presses on its surroundings (thesis 6.11.1: forces that build up
/// unseen damage the hardware).
///
/// r is the greatest of |τ|/B over the joints, τ being a joint's external torque and B its bound, of tool
/// force ÷ its bound, and of the force on the touched object ÷ what that bears. Where r reaches 1, each joint
/// that bears a hundredth of its bound against its way goes no farther that way than a stop s, which begins
/// at its reference and moves by ds/dt = v·clamp(1 − r, −1, 1) towards the target, v being the yield speed.
/// So the references settle where r = 1: the arm holds that force, and yields if its surroundings move. All
/// joints that bear the force count with the same r, or one would press on while another yields. A stop ends
/// when it has reached the target, or the target has come back behind it. While no force is measured, it
/// stays where it is. What an impact exerts before the references yield is not bounded. Real-time safe: yes.
class ContactForceLimit {
 public:
  explicit ContactForceLimit(const ContactForceLimitParameters& parameters) noexcept
      : parameters_(parameters) {}

  /// Returns where the references may go in this tick: `target`, or the stops. `reference`: where they are.
  core::JointArray step(const core::JointArray& target, const core::JointArray& reference,
                        const ContactForce& force, double dt_s) noexcept;
  /// Forgets all stops, as after the references were set otherwise.
  void reset() noexcept { stops_ = {}, forget_held(); }

  /// The joint that is nearest to its bound or beyond, while some are held near theirs; −1: none is.
  int held_joint() const noexcept { return held_joint_; }
  /// Whether the tool's bound holds it.
  bool held_by_tool() const noexcept { return held_by_tool_; }
  /// Whether what the touched object bears holds it.
  bool held_by_object() const noexcept { return held_by_object_; }
  /// How hard it presses: its torque, or the force at the tool, or on the object. N·m or N.
  double held_force() const noexcept { return held_force_; }

 private:
  struct Stop {
    int way = 0;  ///< +1: the reference may not go above `at`; −1: not below it; 0: none
    double at = 0.0;
  };
  double greatest_ratio(const ContactForce& force) noexcept;
  bool bears(std::size_t joint, double external_Nm) const noexcept;
  void forget_held() noexcept {
    held_joint_ = -1, held_by_tool_ = held_by_object_ = false, held_force_ = 0.0;
  }

  ContactForceLimitParameters parameters_;
  std::array<Stop, core::kMaxJoints> stops_{};
  int held_joint_ = -1;
  bool held_by_tool_ = false, held_by_object_ = false;
  double held_force_ = 0.0;
};

}  // namespace phantom::teleop
