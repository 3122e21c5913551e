#pragma once

#include <algorithm>
#include <cstdint>

#include "common/core/joints.hpp"
#include "common/teleop/coupling/ramp.hpp"

namespace phantom::teleop {

/// What carries the weight of the slave's links.
enum class Counterbalance : std::uint8_t {
  kNone,        ///< only the position loops: the weight stands in their torque F_as
  kMechanical,  ///< counterweights
  kAutomatic    ///< the torque of the arm's gravity model, fed forward beside the position loops
};

/// Automatic counterbalancing of an arm without counterweights: feeds the torque that holds its weight
/// forward, so that the position loops, and with them F_as, are left with everything else (row b2 of Table
/// 6.1, "electronic counter balancing"). It is switched while the arm is held, so it fades: the drives'
/// torque stays nearly the same throughout, because the loops give up what is fed forward.
class GravityFeedForward {
 public:
  static constexpr double kFade_s = 1.0;  ///< long against the position loops, so that the arm hardly moves

  /// `balanced`: counterweights carry the weight; nothing is ever fed forward. `on`: in force from the start.
  GravityFeedForward(bool balanced, bool on) noexcept
      : balanced_(balanced), share_(kFade_s, kFade_s, on && !balanced ? 1.0 : 0.0) {}

  /// Returns the torque to feed forward, N·m or N. `gravity_Nm` holds the weight at the present pose.
  /// Real-time safe: yes.
  core::JointArray step(bool on, const core::JointArray& gravity_Nm, double dt_s) noexcept {
    const double share = share_.step(on && !balanced_, dt_s);
    core::JointArray torque_Nm{};
    if (share == 0.0) return torque_Nm;
    for (std::size_t j = 0; j < torque_Nm.size(); ++j) torque_Nm[j] = share * gravity_Nm[j];
    return torque_Nm;
  }
  /// Returns what carries the weight now; while it fades, some of it still stands in F_as: kNone.
  Counterbalance in_force() const noexcept {
    return balanced_               ? Counterbalance::kMechanical
           : share_.value() == 1.0 ? Counterbalance::kAutomatic
                                   : Counterbalance::kNone;
  }

 private:
  bool balanced_;
  Ramp share_;
};

/// Fades what an arm's payload weighs, as it comes and goes: the torque that carries it never jumps.
class PayloadWeight {
 public:
  /// Returns the torque to carry, N·m or N. `weight_Nm`: that of the present payload at the present pose.
  /// `changed`: it is another payload than before. Real-time safe: yes.
  core::JointArray step(const core::JointArray& weight_Nm, bool changed, double dt_s) noexcept {
    if (changed) {
      for (std::size_t j = 0; j < weight_Nm.size(); ++j) offset_Nm_[j] = carried_Nm_[j] - weight_Nm[j];
      left_ = 1.0;
    }
    left_ = std::max(0.0, left_ - dt_s / GravityFeedForward::kFade_s);
    for (std::size_t j = 0; j < weight_Nm.size(); ++j) carried_Nm_[j] = weight_Nm[j] + left_ * offset_Nm_[j];
    return carried_Nm_;
  }

 private:
  core::JointArray carried_Nm_{}, offset_Nm_{};
  double left_ = 0.0;
};

}  // namespace phantom::teleop
