#include "common/teleop/passivity_guard.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {

core::JointArray PassivityGuard::step(const core::JointArray& torque_Nm, const core::JointArray& position,
                                      const core::JointArray& velocity, double dt_s) noexcept {
  active_ = false;
  core::JointArray rendered_Nm{};
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    const double wanted_Nm = std::isfinite(torque_Nm[j]) ? torque_Nm[j] : 0.0;
    rendered_Nm[j] = wanted_Nm;
    if (!parameters_.enabled || !std::isfinite(position[j]) || !std::isfinite(velocity[j])) continue;
    if (started_) energy_J_[j] -= last_torque_Nm_[j] * (position[j] - last_position_[j]);
    energy_J_[j] = std::min(energy_J_[j], parameters_.store_J[j]);
    const double deficit_J = -parameters_.allowance_J[j] - energy_J_[j];
    const double v = velocity[j];
    if (deficit_J > 0.0 && v != 0.0) {
      // −α·v over one period takes α·v²·dt.
      const double damping = std::min(parameters_.damping_limit[j], deficit_J / (v * v * dt_s));
      rendered_Nm[j] -= damping * v;
      active_ = active_ || damping > 0.0;
    }
    last_torque_Nm_[j] = rendered_Nm[j];
    last_position_[j] = position[j];
  }
  started_ = true;
  return rendered_Nm;
}

}  // namespace phantom::teleop
