#include "common/teleop/guards/feedback_observer.hpp"

#include <algorithm>
#include <cmath>

#include "common/robot/kinematics/arm_dynamics.hpp"

namespace phantom::teleop {
namespace {

constexpr double kThresholds = 2.0;  // of the force observer: what is felt is no proof yet

// Returns the distance of the arm's tip from each joint, stretched out: the greatest that it can be.
core::JointArray reach_m(const robot::SerialArm& arm, const Eigen::Vector3d& tip_m) {
  core::JointArray reach{};
  double beyond_m = tip_m.norm();
  for (std::size_t j = arm.joint_count(); j-- > 0;) {
    reach[j] = beyond_m;
    beyond_m += arm.joints()[j].X_parent_joint.translation_m.norm();
  }
  return reach;
}

}  // namespace

FeedbackObserver::FeedbackObserver(const robot::SerialArm& arm, const FeedbackObserverParameters& parameters,
                                   const robot::Buoyancy* buoyancy)
    : arm_(arm), momentum_(arm, parameters.dynamics, buoyancy) {
  const core::JointArray reach = reach_m(arm, parameters.tip_m);
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const robot::Joint& joint = arm.joints()[j];
    const double v = joint.max_speed;
    const double lever_m = joint.type == robot::JointType::kPrismatic ? 1.0 : reach[j];
    greatest_acceleration_[j] = joint.max_effort / parameters.inertia_kg_m2[j];
    threshold_Nm_[j] = kThresholds * parameters.dynamics.threshold_Nm[j];
    allowed_J_[j] = parameters.energy_share * parameters.inertia_kg_m2[j] * v * v;
    stored_J_[j] = allowed_J_[j] + 0.5 * parameters.max_payload_kg * lever_m * lever_m * v * v;
  }
  robot::LoadBody& body = unknown_.on_link[arm.joint_count()];
  body.mass_kg = parameters.max_payload_kg;
  Eigen::Vector3d::Map(body.centre_m.data()) = parameters.tip_m;
}

bool FeedbackObserver::velocity_jumps(const DriveMotion& motion, double dt_s) const noexcept {
  constexpr double kNoise = 0.05;  // of the greatest speed
  for (std::size_t j = 0; j < arm_.joint_count(); ++j) {
    const double most = kJump * greatest_acceleration_[j] * dt_s + kNoise * arm_.joints()[j].max_speed;
    if (!(std::abs(motion.velocity[j] - last_velocity_[j]) <= most)) return true;
  }
  return false;
}

UnexplainedEnergy FeedbackObserver::step(const robot::LinkPoses& X_WL, const core::JointArray& position,
                                         const DriveMotion& motion, double dt_s,
                                         const robot::Payload& payload) noexcept {
  UnexplainedEnergy found;
  DriveMotion taken = motion;
  if (started_ && velocity_jumps(motion, dt_s)) taken.usable = false;
  const core::JointArray before = last_position_;
  started_ = motion.usable;
  last_position_ = position;
  last_velocity_ = motion.velocity;
  if (!momentum_.step(X_WL, taken, dt_s, payload).measured || !(dt_s > 0.0)) {
    energy_J_ = {};
    return found;
  }
  core::JointArray weight_Nm{};
  robot::add_weight(arm_, unknown_, X_WL, weight_Nm);
  for (std::size_t j = 0; j < arm_.joint_count(); ++j) {
    const double hidden_Nm = threshold_Nm_[j] + std::abs(weight_Nm[j]);
    const double r_Nm = momentum_.residual_Nm()[j];
    const double certain_Nm = r_Nm - std::clamp(r_Nm, -hidden_Nm, hidden_Nm);
    double& energy_J = energy_J_[j];
    energy_J *= std::exp(-dt_s / (energy_J > 0.0 ? kForgotten_s : kStored_s));
    energy_J = std::max(-stored_J_[j], energy_J + certain_Nm * (position[j] - before[j]));
    if (found.joint < 0 && energy_J > allowed_J_[j]) found = {static_cast<int>(j), energy_J, allowed_J_[j]};
  }
  return found;
}

}  // namespace phantom::teleop
