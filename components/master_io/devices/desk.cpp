#include "components/master_io/devices/desk.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::master_io {

double shaped(double axis, double dead_zone, double exponent) noexcept {
  if (!std::isfinite(axis)) return 0.0;
  const double beyond = (std::min(std::abs(axis), 1.0) - dead_zone) / (1.0 - dead_zone);
  return beyond <= 0.0 ? 0.0 : std::copysign(std::pow(beyond, exponent), axis);
}

DeskHand::DeskHand(const DeskConfig& config, std::size_t joint_count)
    : joint_count_(joint_count),
      bank_count_(std::min(config.banks.size(), kMaxBanks)),
      dead_zone_(config.dead_zone),
      exponent_(config.exponent),
      push_(config.push),
      brake_(config.brake) {
  std::copy_n(config.banks.begin(), bank_count_, banks_.begin());
}

const core::JointArray& DeskHand::step(const DeskState& desk, const core::JointArray& v) noexcept {
  for (std::size_t j = 0; j < joint_count_; ++j) torque_Nm_[j] = -brake_[j] * v[j];
  if (!desk.alive || bank_count_ == 0) return torque_Nm_;
  const auto& bank = banks_[desk.bank % bank_count_];
  for (std::size_t k = 0; k < kDeskAxes; ++k) {
    const auto joint = static_cast<std::size_t>(bank[k]);  // −1 wraps to a value far above the joint count
    if (joint < joint_count_) torque_Nm_[joint] += push_[joint] * shaped(desk.axes[k], dead_zone_, exponent_);
  }
  return torque_Nm_;
}

}  // namespace phantom::master_io
