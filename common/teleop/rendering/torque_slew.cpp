#include "common/teleop/rendering/torque_slew.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {
namespace {

double towards(double from, double target, double cap, double furthest) noexcept {
  const double wanted = std::isfinite(target) ? std::clamp(target, -cap, cap) : 0.0;
  return from + std::clamp(wanted - from, -furthest, furthest);
}

}  // namespace

TorqueSlew::TorqueSlew(const TorqueSlewParameters& parameters) : parameters_(parameters) {
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    auto& p = parameters_;
    p.percept_cap_Nm[j] = std::min(p.percept_cap_Nm[j], p.limit_Nm[j]);
    p.feedback_cap_Nm[j] = std::min(p.feedback_cap_Nm[j], p.limit_Nm[j]);
    const double sum = p.percept_cap_Nm[j] + p.feedback_cap_Nm[j];
    const double share = sum > 0.0 ? p.percept_cap_Nm[j] / sum : 0.0;
    percept_rate_[j] = share * p.rate_Nm_per_s[j];
    feedback_rate_[j] = (1.0 - share) * p.rate_Nm_per_s[j];
  }
}

// Reduces the percept where it would push at this velocity.
void TorqueSlew::let_go(const core::JointArray& velocity) noexcept {
  double pushes_W = 0.0, takes_W = 0.0;
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    const double power_W = now_.percept_Nm[j] * velocity[j];
    if (!std::isfinite(power_W)) {
      now_.percept_Nm[j] = 0.0;
    } else {
      (power_W > 0.0 ? pushes_W : takes_W) += power_W;
    }
  }
  const bool coupled = parameters_.mode == robot::DragMode::kCoupled;
  if (pushes_W <= 0.0 || (coupled && pushes_W + takes_W <= 0.0)) return;
  // Slightly less than what would cancel, so that rounding leaves no push.
  const double share =
      coupled && std::isfinite(pushes_W) && std::isfinite(takes_W) ? (1.0 - 1e-9) * -takes_W / pushes_W : 0.0;
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    if (now_.percept_Nm[j] * velocity[j] > 0.0) now_.percept_Nm[j] *= share;
  }
}

const SlewedTorque& TorqueSlew::step(const core::JointArray& percept_Nm, const core::JointArray& feedback_Nm,
                                     const core::JointArray& velocity, double dt_s) noexcept {
  const auto& p = parameters_;
  now_.percept_capped = now_.feedback_capped = false;
  for (std::size_t j = 0; j < p.joint_count; ++j) {
    now_.percept_capped = now_.percept_capped || std::abs(percept_Nm[j]) > p.percept_cap_Nm[j];
    now_.feedback_capped = now_.feedback_capped || std::abs(feedback_Nm[j]) > p.feedback_cap_Nm[j];
    now_.percept_Nm[j] =
        towards(now_.percept_Nm[j], percept_Nm[j], p.percept_cap_Nm[j], percept_rate_[j] * dt_s);
    feedback_Nm_[j] =
        towards(feedback_Nm_[j], feedback_Nm[j], p.feedback_cap_Nm[j], feedback_rate_[j] * dt_s);
  }
  let_go(velocity);
  for (std::size_t j = 0; j < p.joint_count; ++j) {
    // The device's limit reduces the feedback only, so that drag keeps opposing the motion.
    const double both_Nm = now_.percept_Nm[j] + feedback_Nm_[j];
    now_.motor_Nm[j] = std::clamp(both_Nm, -p.limit_Nm[j], p.limit_Nm[j]);
    now_.feedback_capped = now_.feedback_capped || now_.motor_Nm[j] != both_Nm;
    now_.feedback_Nm[j] = now_.motor_Nm[j] - now_.percept_Nm[j];
  }
  return now_;
}

}  // namespace phantom::teleop
