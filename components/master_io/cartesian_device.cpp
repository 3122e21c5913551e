#include "components/master_io/cartesian_device.hpp"

#include <algorithm>

namespace phantom::master_io {
namespace {

using robot::Spatial;

Spatial turned(const Eigen::Matrix3d& R, const Spatial& v) noexcept {
  Spatial result;
  result << R * v.head<3>(), R * v.tail<3>();
  return result;
}

core::JointArray array_of(const Spatial& v) noexcept {
  core::JointArray values{};
  std::copy_n(v.data(), kCartesianAxes, values.begin());
  return values;
}

}  // namespace

CartesianDevice::CartesianDevice(const Config& config, const robot::SerialArm& arm,
                                 const core::JointArray& start_q)
    : parameters_(config.cartesian.value()),
      joint_count_(arm.joint_count()),
      R_home_(tool_pose_at(arm, start_q).rotation),
      hand_(arm, parameters_.hand, start_q),
      slew_(parameters_.wrench),
      plant_(parameters_.handle),
      person_(parameters_.indexing),
      pushed_(parameters_.input != CartesianInput::kSimulated) {
  handle_.valid = true;
  clutch_out_ = pushed_;  // the simulated person begins with it in
}

const DeviceSense& CartesianDevice::sense() noexcept {
  handle_.pose = plant_.pose();
  handle_.twist = plant_.twist();
  handle_.clutch = !clutch_out_;
  hand_.sense(handle_, R_WV_ ? &*R_WV_ : nullptr);
  sense_.position = hand_.position();
  sense_.velocity = hand_.velocity();
  sense_.hand_position = tool_coordinates(parameters_, R_home_, hand_.tool_pose());
  sense_.hand_velocity =
      array_of(pushed_ ? plant_.true_twist() : turned(hand_.rotation(), plant_.true_twist()));
  sense_.hand_waits = !handle_.clutch || hand_.authority() < 1.0;
  return sense_;
}

void CartesianDevice::move(const DeviceDemand& demand, double dt_s, core::Nanoseconds) noexcept {
  const Spatial before = slew_.wrench();
  slew_.step(hand_.wrench(demand.motor_Nm), handle_.twist, dt_s);
  note(before, demand, dt_s);
  Spatial task;
  std::copy_n(demand.hand_Nm.begin(), kCartesianAxes, task.data());
  const bool was_in = handle_.clutch;
  const Spatial push =
      pushed_ ? task
              : person_.step(plant_.pose(), plant_.true_twist(), turned(hand_.rotation().transpose(), task));
  clutch_out_ = pushed_ ? demand.clutch_out : !person_.clutch();
  figures_.clutched_out += was_in && clutch_out_ ? 1U : 0U;
  R_WV_.reset();
  if (demand.view != nullptr) R_WV_ = Eigen::Map<const Eigen::Matrix3d>(demand.view->R_WC.data());
  if (demand.meet != nullptr) {
    hand_.meet(*demand.meet, dt_s);
  } else {
    hand_.advance(demand.coupled, dt_s);
  }
  plant_.step(push, slew_.wrench(), dt_s);
}

void CartesianDevice::note(const Spatial& before, const DeviceDemand& demand, double dt_s) noexcept {
  const Spatial& now = slew_.wrench();
  double joints_W = 0.0;
  for (std::size_t j = 0; j < joint_count_; ++j) joints_W += demand.motor_Nm[j] * hand_.velocity()[j];
  const double hand_W = now.dot(handle_.twist), force_N = now.head<3>().norm();
  auto& f = figures_;
  f.greatest_force_N = std::max(f.greatest_force_N, force_N);
  f.greatest_moment_N_m = std::max(f.greatest_moment_N_m, now.tail<3>().norm());
  if (before.dot(handle_.twist) <= 0.0)  // what pushes may fall at once
    f.steepest_force_N_per_s = std::max(f.steepest_force_N_per_s, (now - before).head<3>().norm() / dt_s);
  f.greatest_excess_W = std::max(f.greatest_excess_W, hand_W - std::max(0.0, joints_W));
  f.energy_from_hand_J -= hand_W * dt_s;
  if (hand_.authority() > 0.0) f.least_followed = std::min(f.least_followed, hand_.least_followed());
}

}  // namespace phantom::master_io
