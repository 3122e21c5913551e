#include "components/slave_io/can_arm.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/robot/kinematics/arm_dynamics.hpp"

namespace phantom::slave_io {
namespace {

teleop::FeedbackObserverParameters feedback_of(const ArmModel& model, const Config& config) {
  teleop::FeedbackObserverParameters parameters{.dynamics = *config.force_observer,
                                                .energy_share = config.unexplained_energy_share,
                                                .max_payload_kg = config.max_payload_kg,
                                                .tip_m = model.tip_in_last_link_m};
  for (std::size_t j = 0; j < model.arm.joint_count(); ++j)
    parameters.inertia_kg_m2[j] = config.plant.joints[j].inertia;
  return parameters;
}

}  // namespace

CanArm::CanArm(const ArmModel& model, const Config& config, std::vector<std::unique_ptr<can::CanBus>> buses)
    : model_(model),
      axes_(config.can.value().group.axes),
      balanced_(config.plant.balanced),
      held_(config.held),
      drives_(config.can->group, config.align_tolerance, std::move(buses)) {
  for (std::size_t j = 0; j < axes_.size(); ++j) {
    const auto& gains = config.gains[j];
    velocity_per_error_[j] = gains.k_v > 0.0 ? gains.k_p / gains.k_v : 0.0;
  }
  if (config.force_observer) feedback_.emplace(model.arm, feedback_of(model, config), &model.buoyancy);
  if (!config.force_sensor || !config.force_observer) return;
  observer_.emplace(model.arm, *config.force_observer, &model.buoyancy);
  if (config.wrist) return;  // its lag and threshold are those of F_e
  double threshold = 0.0;
  for (std::size_t j = 0; j < axes_.size(); ++j) {
    threshold =
        std::max(threshold, config.force_observer->threshold_Nm[j] / model.arm.joints()[j].max_effort);
  }
  force_figures_ = {{"force_lag", force_lag_s(config), "s"}, {"force_threshold", threshold, "of effort"}};
}

const ArmSense& CanArm::sense() noexcept {
  const can::ArmDrivesSense& drives = drives_.sense();
  sense_.known = drives.known;
  sense_.position = drives.position;
  sense_.velocity = drives.velocity;
  sense_.follows = drives.follows;
  sense_.fault = drives.fault;
  sense_.inputs = drives.inputs;
  sense_.homing = homing_of(drives);
  exerted_Nm_ = drives.torque;
  model_.arm.link_poses(sense_.position, X_WL_);
  if (!balanced_) sense_.gravity_Nm = weight_Nm();
  const teleop::DriveMotion motion{drives.follows && drives.current, drives.velocity, drives.torque};
  if (observer_) external_ = observer_->step(X_WL_, motion, since_last_s_, payload_);
  // A torque that acted for longer than its period did more work than would be counted.
  teleop::DriveMotion timely = motion;
  timely.usable = motion.usable && punctual_;
  if (feedback_) unexplained_ = feedback_->step(X_WL_, drives.position, timely, since_last_s_, payload_);
  return sense_;
}

/// Returns the torques that hold the links and, as it fades in, the payload, less their lift.
core::JointArray CanArm::weight_Nm() noexcept {
  core::JointArray payload_Nm{}, whole_Nm = model_.arm.gravity_torque(X_WL_);
  model_.buoyancy.add_lift(model_.arm, X_WL_, whole_Nm);
  robot::add_weight(model_.arm, payload_, X_WL_, payload_Nm);
  model_.buoyancy.add_lift(model_.arm, payload_, X_WL_, payload_Nm);
  payload_Nm = payload_weight_.step(payload_Nm, std::exchange(payload_changed_, false), since_last_s_);
  for (std::size_t j = 0; j < whole_Nm.size(); ++j) whole_Nm[j] += payload_Nm[j];
  return whole_Nm;
}

void CanArm::carry(const robot::Payload& payload) noexcept {
  payload_changed_ = payload_changed_ || !(payload == payload_);
  payload_ = payload;
}

void CanArm::move(const ArmDemand& demand, double dt_s, core::Nanoseconds now_ns) noexcept {
  since_last_s_ = dt_s;
  punctual_ = std::abs(core::seconds(now_ns - moved_ns_) - dt_s) < 0.5 * dt_s;
  moved_ns_ = now_ns;
  weight_Nm_ = demand.outputs.weight_Nm;
  can::DriveCommand command{
      .enable = demand.outputs.power && !demand.stop,
      .quick_stop = demand.stop,
      .reset = demand.reset,
      .home = demand.home,
      .hasten = demand.outputs.loop.late,
      .implausible_axis = unexplained_.joint,
      .implausible = {can::Implausibility::kEnergy, unexplained_.seen_J, unexplained_.allowed_J},
      .position = demand.outputs.reference};
  for (std::size_t j = 0; j < axes_.size(); ++j) {
    const bool by_torque = axes_[j].mode == can::DriveMode::kTorque;
    command.torque[j] = by_torque ? demand.outputs.torque.drive_Nm[j] : weight_Nm_[j];
    const double share = demand.outputs.loop.share_within(held_[j].longest_s);
    command.velocity[j] = demand.outputs.reference_velocity[j] +
                          share * velocity_per_error_[j] * (demand.outputs.reference[j] - sense_.position[j]);
  }
  drives_.step(command, now_ns);
}

core::ActuatorHealth CanArm::health() {
  core::ActuatorHealth health = drives_.health();
  health.figures.insert(health.figures.end(), force_figures_.begin(), force_figures_.end());
  return health;
}

void CanArm::fill(messages::SlaveState& state) const noexcept {
  state.position = sense_.position;
  state.velocity = sense_.velocity;
  state.force_measured = external_.measured;
  state.external_torque_Nm = external_.torque_Nm;
  state.contact = external_.contact;
  for (std::size_t j = 0; j < axes_.size(); ++j) {
    // If the position loop is closed in the drive, its torque is the torque that the drive exerts.
    if (axes_[j].mode != can::DriveMode::kTorque) state.loop_torque_Nm[j] = exerted_Nm_[j] - weight_Nm_[j];
    if (!sense_.follows) state.loop_torque_Nm[j] = 0.0;
  }
  const std::size_t last = model_.arm.joint_count();
  state.tool_speed_m_s =
      model_.arm.point_velocity_W(last, X_WL_[last] * model_.tip_in_last_link_m, X_WL_, sense_.velocity)
          .norm();
}

}  // namespace phantom::slave_io
