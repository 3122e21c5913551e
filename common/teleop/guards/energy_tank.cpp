#include "common/teleop/guards/energy_tank.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {
namespace {

constexpr double kMotionFilter_s = 0.005;  // longer than an encoder's steps at a slow motion

}  // namespace

void EnergyTank::reset() noexcept {
  balance_J_ = 0.0;
  motion_ = {};
  last_torque_Nm_ = {};
  started_ = active_ = false;
}

void EnergyTank::note_rendered(const core::JointArray& torque_Nm) noexcept {
  for (std::size_t j = 0; j < parameters_.joint_count; ++j)
    last_torque_Nm_[j] = std::isfinite(torque_Nm[j]) ? torque_Nm[j] : 0.0;
}

void EnergyTank::note_share(double share) noexcept {
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) last_torque_Nm_[j] *= share;
}

core::JointArray EnergyTank::step(const core::JointArray& torque_Nm, const core::JointArray& position,
                                  double dt_s) noexcept {
  core::JointArray rendered_Nm{};
  const std::size_t count = parameters_.joint_count;
  const double share = dt_s / (dt_s + kMotionFilter_s);
  double power_W = 0.0;
  for (std::size_t j = 0; j < count; ++j) {
    rendered_Nm[j] = std::isfinite(torque_Nm[j]) ? torque_Nm[j] : 0.0;
    const double here = std::isfinite(position[j]) ? position[j] : last_position_[j];
    const double way = started_ ? here - last_position_[j] : 0.0;
    balance_J_ -= last_torque_Nm_[j] * way;
    motion_[j] += share * (way / dt_s - motion_[j]);
    last_position_[j] = here;
    power_W += rendered_Nm[j] * motion_[j];
  }
  started_ = true;
  balance_J_ = std::min(balance_J_, parameters_.store_J);
  const double left_J = balance_J_ + parameters_.allowance_J;
  const double scale = power_W <= 0.0 ? 1.0
                       : parameters_.allowance_J > 0.0
                           ? std::clamp(left_J / parameters_.allowance_J, 0.0, 1.0)
                           : (left_J > 0.0 ? 1.0 : 0.0);
  active_ = scale < 1.0;
  for (std::size_t j = 0; j < count; ++j) rendered_Nm[j] *= scale;
  last_torque_Nm_ = rendered_Nm;
  return rendered_Nm;
}

}  // namespace phantom::teleop
