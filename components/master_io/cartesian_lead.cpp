#include "components/master_io/cartesian_lead.hpp"

#include <algorithm>

namespace phantom::master_io {

using robot::Spatial;

Spatial actuated(const Spatial& wrench, std::uint32_t axes, const Spatial& twist) noexcept {
  Spatial left = wrench;
  for (int i = 0; i < static_cast<int>(kCartesianAxes); ++i) {
    if ((axes >> i & 1U) == 0) left[i] = 0.0;
  }
  const double power_W = left.dot(twist), allowed_W = std::max(0.0, wrench.dot(twist));
  return power_W > allowed_W ? Spatial(allowed_W / power_W * left) : left;
}

CartesianLead::CartesianLead(const CartesianConfig& config, const robot::SerialArm& arm,
                             const core::JointArray& start_q)
    : joint_count_(arm.joint_count()), hand_(arm, config.hand, start_q), slew_(config.wrench) {}

void CartesianLead::sense(const teleop::HandState& handle, DeviceSense& sense) noexcept {
  figures_.clutched_out += handle_.clutch && !handle.clutch ? 1U : 0U;
  handle_ = handle;
  hand_.sense(handle_, R_WV_ ? &*R_WV_ : nullptr);
  sense.position = hand_.position();
  sense.velocity = hand_.velocity();
  sense.rendered_share = rendered_share_;
}

void CartesianLead::render(const DeviceDemand& demand, std::uint32_t axes, double dt_s) noexcept {
  const Spatial before = slew_.wrench();
  slew_.step(actuated(hand_.wrench(demand.motor_Nm), axes, handle_.twist), handle_.twist, dt_s);
  note(before, demand, dt_s);
}

void CartesianLead::advance(const DeviceDemand& demand, double dt_s) noexcept {
  R_WV_.reset();
  if (demand.view != nullptr) R_WV_ = Eigen::Map<const Eigen::Matrix3d>(demand.view->R_WC.data());
  if (demand.meet != nullptr) {
    hand_.meet(*demand.meet, dt_s);
  } else {
    hand_.advance(demand.coupled, dt_s);
  }
}

void CartesianLead::note(const Spatial& before, const DeviceDemand& demand, double dt_s) noexcept {
  const Spatial& now = slew_.wrench();
  double joints_W = 0.0;
  for (std::size_t j = 0; j < joint_count_; ++j) joints_W += demand.motor_Nm[j] * hand_.velocity()[j];
  const double hand_W = now.dot(handle_.twist), force_N = now.head<3>().norm();
  // Neither the caps nor the slew nor axes without motors give more power than the joints' torques have.
  rendered_share_ = joints_W != 0.0 ? std::clamp(hand_W / joints_W, 0.0, 1.0) : 0.0;
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
