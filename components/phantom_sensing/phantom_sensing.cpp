#include "components/phantom_sensing/phantom_sensing.hpp"

#include "common/percept/closeness.hpp"

namespace phantom::phantom_sensing {

PhantomSensing::PhantomSensing(const PhantomModel& model, const PerceptSettings& settings)
    : model_(model),
      settings_(settings),
      sensing_(model.skin, {settings.directional.enabled, settings.gradient_reach_vox}),
      zone_(settings.cluster_reach_vox, settings.cluster_shape),
      hits_(settings.hit, settings.alert) {}

void PhantomSensing::perceive(const StepInputs& inputs, StepOutputs& outputs) noexcept {
  const voxel::Workspace& workspace = *inputs.workspace.voxels;
  SkinPercept& percept = outputs.percept;
  percept.worst = sensing_.worst();
  std::optional<percept::HitCandidate> candidate;
  if (percept.worst.found) {
    const robot::WorstSensor& worst = percept.worst;
    const auto mu = static_cast<double>(worst.mu);
    percept.closeness = percept::closeness(mu, inputs.workspace.greatest_neighbour_mu);
    percept.velocity_W_m_s =
        model_.arm.point_velocity_W(worst.link, worst.position_W_m, X_WL_, inputs.velocity);
    percept.gradient = zone_.gradient(workspace, worst.voxel);
    percept.motion =
        percept::classify_motion(percept.gradient.pgv_W_m, percept.velocity_W_m_s, settings_.motion);
    const auto cosine = percept::approach_cosine(percept.gradient.pgv_W_m, percept.velocity_W_m_s,
                                                 settings_.motion.least_speed_m_s);
    candidate = percept::HitCandidate{{mu, percept.velocity_W_m_s.norm(), cosine},
                                      static_cast<std::uint32_t>(worst.link),
                                      static_cast<std::uint32_t>(worst.sensor),
                                      worst.object,
                                      worst.position_W_m,
                                      percept.gradient.pgv_W_m};
  }
  outputs.alerts = hits_.step(candidate, inputs.dt_s);
  percept.rule = hits_.rule();
  percept.drag_torque =
      robot::drag_torque(outputs.drag, settings_.mode, inputs.velocity, model_.arm.joint_count());
}

void PhantomSensing::step(const StepInputs& inputs, StepOutputs& outputs) noexcept {
  outputs = {};
  const bool known = inputs.workspace.voxels != nullptr;
  if (known) outputs.workspace_version = inputs.workspace.voxels->version;
  if (!known || !inputs.state_valid) {
    outputs.alerts = hits_.close();  // what an alert rests on is no longer known
    return;
  }
  model_.arm.link_poses(inputs.position, X_WL_);
  sensing_.sense(X_WL_, model_.arm.joint_count(), *inputs.workspace.voxels);
  robot::drag_coefficients(model_.arm, X_WL_, sensing_.sums(), settings_.directional, outputs.drag);
  outputs.valid = true;
  outputs.active_sensors = sensing_.active();
  perceive(inputs, outputs);
}

}  // namespace phantom::phantom_sensing
