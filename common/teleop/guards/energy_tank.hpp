#pragma once

#include <cstddef>

#include "common/core/joints.hpp"

namespace phantom::teleop {

struct EnergyTankParameters {
  std::size_t joint_count = 0;
  double allowance_J = 0.0;  ///< that the torques may give to the hand beyond what they took, ≥ 0
  double store_J = 0.0;      ///< greatest energy balance that they may save up, ≥ 0
};

/// Bounds the energy that a set of torques gives to the hand, whatever computes them, over the joints'
/// positions alone.
///
/// The balance adds up what the torques take in each period, Σ −τ_j(k−1)·(q_j(k) − q_j(k−1)): exact for
/// torques that are held between samples. While the joints move with the torques, all of these are scaled by
/// (balance + allowance) ÷ allowance, within 0…1; while they move against the torques nothing is scaled. So
/// the balance falls below −allowance only by what one period gives after a reversal. No velocity is used:
/// one with a wrong sign or scale makes no difference. One factor for all joints keeps a coupled law what it
/// is. Source: passivity observer of Hannaford and Ryu (2002); energy tank of Franken et al. (2011).
class EnergyTank {
 public:
  explicit EnergyTank(const EnergyTankParameters& parameters) noexcept : parameters_(parameters) {}

  /// Returns the torques to render instead of `torque_Nm` at the device's position, N·m or N. What is not
  /// finite counts as zero torque, and as no motion. Real-time safe: yes.
  core::JointArray step(const core::JointArray& torque_Nm, const core::JointArray& position,
                        double dt_s) noexcept;
  /// Records the torques that the device received in the end instead of step()'s. Real-time safe: yes.
  void note_rendered(const core::JointArray& torque_Nm) noexcept;
  /// Records that the device rendered only `share`, 0…1, of the torques recorded last. Real-time safe: yes.
  void note_share(double share) noexcept;
  /// Starts the balance over. Real-time safe: yes.
  void reset() noexcept;

  /// Returns whether the last step() scaled the torques down.
  bool active() const noexcept { return active_; }
  /// Returns the energy balance, J: > 0 was taken from the hand, < 0 was given to it.
  double balance_J() const noexcept { return balance_J_; }

 private:
  EnergyTankParameters parameters_;
  core::JointArray last_torque_Nm_{}, last_position_{};
  core::JointArray motion_{};  // per second, by position, filtered: where the joints go
  double balance_J_ = 0.0;
  bool started_ = false, active_ = false;
};

}  // namespace phantom::teleop
