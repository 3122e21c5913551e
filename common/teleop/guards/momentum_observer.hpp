#pragma once

#include <cstddef>

#include "common/core/joints.hpp"
#include "common/robot/drag/buoyancy.hpp"
#include "common/robot/kinematics/payload.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/teleop/guards/contact_latch.hpp"

namespace phantom::teleop {

/// What is known of the arm. Arrays have one value per joint; of a prismatic joint read kg, N and m.
struct MomentumObserverParameters {
  double lag_s = 0.01;              ///< 1/K_I: time constant with which the estimate follows, > 0
  core::JointArray threshold_Nm{};  ///< > 0; what friction, inertia, payload and drives may do unmodelled
  core::JointArray coulomb_Nm{}, viscous_Nms_per_rad{};  ///< friction
  core::JointArray slow_rad_s{};     ///< > 0; the Coulomb friction rises linearly up to this speed
  core::JointArray inertia_kg_m2{};  ///< of the drives at their joints; without `coupled` of all that moves
  bool coupled = true;  ///< the links' inertias act through all joints; false: each joint is on its own
  bool weight = false;  ///< the links' weight acts on the joints; false: the arm is balanced
};

/// The drives' answers to one SYNC.
struct DriveMotion {
  bool usable = false;  ///< all drives follow, and all answered
  core::JointArray velocity{}, torque_Nm{};
};

struct ExternalTorque {
  bool measured = false;         ///< false: nothing is known, and the rest is zero
  core::JointArray torque_Nm{};  ///< F_e: torques that the surroundings exert on the joints
  bool contact = false;
};

/// Estimates the external joint torques from those that the drives exert: a momentum observer (De Luca,
/// Albu-Schäffer, Haddadin, Hirzinger 2006). r = K_I·(p − ∫(τ − friction + Cᵀv − g + r)dt) is the external
/// torque behind a first-order low-pass of time constant 1/K_I, joint by joint, without any acceleration.
///
/// F_e is r less the threshold, towards zero (a soft threshold: continuous, never steeper than 1). Contact
/// begins when a joint's |r| exceeds its threshold (ContactLatch). The observer starts from r = 0 and says
/// nothing for kSettleLags time constants; then r is within 5 % of a constant torque. It starts anew after
/// any sample that is not usable or not finite.
class MomentumObserver {
 public:
  /// `arm` and `buoyancy` must outlive the observer. The lift of links and payload is known, whether their
  /// weight acts or the arm is balanced; null: the arm is in air.
  MomentumObserver(const robot::SerialArm& arm, const MomentumObserverParameters& parameters,
                   const robot::Buoyancy* buoyancy = nullptr)
      : arm_(arm), buoyancy_(buoyancy), parameters_(parameters) {}

  static constexpr double kSettleLags = 3.0;

  /// Takes the next sample, `dt_s` after the one before, with the links at `X_WL`. `payload`: what the arm
  /// carries; its weight acts also where the arm itself is balanced. When it changes, r stays what it was for
  /// that sample: the momentum that comes with the body was not caused by a torque. Real-time safe: yes.
  const ExternalTorque& step(const robot::LinkPoses& X_WL, const DriveMotion& motion, double dt_s,
                             const robot::Payload& payload = {}) noexcept;
  /// Returns r, before the threshold; N·m or N.
  const core::JointArray& residual_Nm() const noexcept { return residual_Nm_; }

 private:
  void restart() noexcept;
  void follow(const core::JointArray& momentum, const core::JointArray& known_Nm, double dt_s) noexcept;
  double greatest_share() const noexcept;

  const robot::SerialArm& arm_;
  const robot::Buoyancy* buoyancy_;
  MomentumObserverParameters parameters_;
  robot::Payload payload_;
  core::JointArray momentum_{}, residual_Nm_{};
  bool started_ = false;
  double age_s_ = 0.0;
  ContactLatch contact_;
  ExternalTorque external_;
};

}  // namespace phantom::teleop
