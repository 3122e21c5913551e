#include "components/master_io/devices/mapped_device.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::master_io {
namespace {

// An arm that sags a little as it comes to its own pose must not be followed down. One that was moved by hand
// meanwhile is taken where it is.
constexpr double kMovedByTolerances = 10.0;

}  // namespace

MappedDevice::MappedDevice(const MappingConfig& config, std::unique_ptr<Device> own,
                           const core::JointArray& start_q)
    : config_(config), mapping_(config.mapping), own_(std::move(own)), others_(start_q) {
  for (std::size_t j = 0; j < config_.mapping.arm_joints; ++j)
    others_[j] = config_.held[j].value_or(start_q[j]);
}

const DeviceSense& MappedDevice::sense(core::Nanoseconds now_ns) noexcept {
  const DeviceSense& own = own_->sense(now_ns);
  own_velocity_ = own.velocity;
  sense_ = own;
  sense_.position = mapping_.arm_position(own.position, others_);
  sense_.velocity = mapping_.arm_velocity(own.velocity);
  sense_.hand_position = mapping_.arm_position(own.hand_position, others_);
  sense_.hand_velocity = mapping_.arm_velocity(own.hand_velocity);
  return sense_;
}

void MappedDevice::move(const DeviceDemand& demand, double dt_s, core::Nanoseconds now_ns) noexcept {
  DeviceDemand own = demand;
  own.motor_Nm = mapping_.master_torque(demand.motor_Nm);
  own.hand_Nm = mapping_.master_torque(demand.hand_Nm);
  own.meet = nullptr;
  hold(demand.meet);
  own_->move(own, dt_s, now_ns);
  for (std::size_t m = 0; m < mapping_.master_joints(); ++m) {
    double& greatest_Nm = figures_.greatest_torque_Nm[m];
    greatest_Nm = std::max(greatest_Nm, std::abs(own.motor_Nm[m]));
    figures_.energy_from_hand_J[m] -= own.motor_Nm[m] * own_velocity_[m] * dt_s;
  }
}

void MappedDevice::hold(const core::JointArray* arm_q) noexcept {
  const bool was_apart = apart_;
  apart_ = arm_q != nullptr;
  if (!apart_) return;
  for (std::size_t j = 0; j < config_.mapping.arm_joints; ++j) {
    const double q = (*arm_q)[j];
    const bool moved = std::abs(q - others_[j]) > kMovedByTolerances * config_.arm_tolerance[j];
    if (!config_.held[j] && (!was_apart || moved)) others_[j] = q;
  }
}

}  // namespace phantom::master_io
