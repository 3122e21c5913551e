#include "common/teleop/guards/passivity_guard.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {

// Moves α of a joint by its bounded rate and returns it.
double PassivityGuard::damping_for(std::size_t joint, double velocity, double dt_s) noexcept {
  const double limit = parameters_.damping_limit[joint];
  const double deficit_J = -parameters_.allowance_J[joint] - energy_J_[joint];
  double needed = 0.0;
  // −α·v takes the energy α·v²·dt in one period.
  if (deficit_J > 0.0)
    needed = velocity == 0.0 ? limit : std::min(limit, deficit_J / (velocity * velocity * dt_s));
  const double change =
      std::clamp(needed - damping_[joint], -limit * dt_s / kRelease_s, limit * dt_s / kEngage_s);
  return damping_[joint] += change;
}

void PassivityGuard::note_rendered(const core::JointArray& torque_Nm) noexcept {
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    if (std::isfinite(torque_Nm[j])) last_torque_Nm_[j] = torque_Nm[j];
  }
}

void PassivityGuard::note_share(double share) noexcept {
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) last_torque_Nm_[j] *= share;
}

core::JointArray PassivityGuard::step(const core::JointArray& torque_Nm, const core::JointArray& position,
                                      const core::JointArray& velocity, double authority,
                                      double dt_s) noexcept {
  active_ = false;
  core::JointArray rendered_Nm{};
  if (authority <= 0.0) {
    energy_J_ = damping_ = {};
    started_ = false;
  }
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    rendered_Nm[j] = std::isfinite(torque_Nm[j]) ? torque_Nm[j] : 0.0;
    if (!parameters_.enabled || !std::isfinite(position[j]) || !std::isfinite(velocity[j])) continue;
    if (started_) energy_J_[j] -= last_torque_Nm_[j] * (position[j] - last_position_[j]);
    energy_J_[j] = std::min(energy_J_[j], parameters_.store_J[j]);
    if (authority > 0.0) {
      const double damping = authority * damping_for(j, velocity[j], dt_s);
      rendered_Nm[j] -= damping * velocity[j];
      active_ = active_ || damping > 0.0;
    }
    last_torque_Nm_[j] = rendered_Nm[j];
    last_position_[j] = position[j];
  }
  started_ = true;
  return rendered_Nm;
}

}  // namespace phantom::teleop
