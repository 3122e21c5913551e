#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "common/core/joints.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/teleop/guards/momentum_observer.hpp"

namespace phantom::teleop {

struct FeedbackObserverParameters {
  MomentumObserverParameters
      dynamics;                      ///< what is known of the arm; its threshold stays out of account twice
  core::JointArray inertia_kg_m2{};  ///< of all that each joint moves, > 0; kg of a prismatic one
  /// Energy that a joint may seem to gain from nowhere, as a share of inertia · (greatest speed)². > 0
  double energy_share = 0.25;
  double max_payload_kg = 0.0;                      ///< greatest unmodelled payload at the tip, ≥ 0
  Eigen::Vector3d tip_m = Eigen::Vector3d::Zero();  ///< in the last link's frame
};

/// A joint that moves with more energy than it can have.
struct UnexplainedEnergy {
  int joint = -1;  ///< −1: none
  double seen_J = 0.0, allowed_J = 0.0;
};

/// Finds feedback that is false in itself consistently – a position and a velocity that are mirrored
/// together – by the arm's dynamics, as nothing else in it gives it away.
///
/// A slave arm's surroundings are passive: they take energy, and give back what they stored. So the external
/// torque r that a momentum observer finds must not do positive work on a joint in the long run. The work of
/// what exceeds twice the observer's threshold and the weight of an unknown payload is added up joint by
/// joint, over the way by position. A velocity that jumps by more than kJump times what the joint's greatest
/// torque can do starts all over: whether it fits its position is for others to say. It is found beyond
/// energy_share · inertia · (greatest speed)². A mirrored joint that is accelerated by τ reports the momentum
/// −p: r = −2 τ does the work of 2 τ v. Where a spring was loaded before, the sum is below zero, and kept for
/// kStored_s, at least as low as what an unknown payload may take up as it is accelerated; above zero it is
/// forgotten within kForgotten_s.
///
/// What it misses: a motion reported too small or too slow by a factor (it looks like a contact); a joint
/// that is moved with less torque than the thresholds. What it takes for false: surroundings that drive the
/// arm, such as another arm that pushes it along. A hand does so with a master: it is no use there.
class FeedbackObserver {
 public:
  static constexpr double kForgotten_s = 1.0, kStored_s = 60.0, kJump = 5.0;

  /// `arm` and `buoyancy` must outlive the observer; null: the arm is in air.
  FeedbackObserver(const robot::SerialArm& arm, const FeedbackObserverParameters& parameters,
                   const robot::Buoyancy* buoyancy = nullptr);

  /// Takes the next sample as MomentumObserver::step() does, at `position` (rad or m); returns the first
  /// joint with energy that its torque did not give it. Real-time safe: yes.
  UnexplainedEnergy step(const robot::LinkPoses& X_WL, const core::JointArray& position,
                         const DriveMotion& motion, double dt_s, const robot::Payload& payload = {}) noexcept;
  /// Returns the energy that a joint seems to have gained, J.
  double energy_J(std::size_t joint) const noexcept { return energy_J_[joint]; }

 private:
  const robot::SerialArm& arm_;
  MomentumObserver momentum_;
  bool velocity_jumps(const DriveMotion& motion, double dt_s) const noexcept;

  core::JointArray threshold_Nm_{}, allowed_J_{}, stored_J_{}, energy_J_{};
  core::JointArray greatest_acceleration_{}, last_position_{}, last_velocity_{};
  bool started_ = false;
  robot::Payload unknown_;  // the heaviest, at the tip
};

}  // namespace phantom::teleop
