#include "components/phantom_sensing/dds_adapter_messages.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace phantom::phantom_sensing {
namespace {

msg::Echo echo_of(const SampleId& id) {
  msg::Echo echo;
  echo.sequence_number(id.sequence_number);
  echo.monotonic_ns(id.monotonic_ns);
  echo.session(id.session);
  return echo;
}

msg::Vector3 vector_of(const Eigen::Vector3d& v) {
  msg::Vector3 message;
  message.x(v.x());
  message.y(v.y());
  message.z(v.z());
  return message;
}

msg::MotionClass motion_of(percept::MotionClass motion) {
  switch (motion) {
    case percept::MotionClass::kSafe:
      return msg::MOTION_SAFE;
    case percept::MotionClass::kNeutral:
      return msg::MOTION_NEUTRAL;
    case percept::MotionClass::kDangerous:
      return msg::MOTION_DANGEROUS;
    case percept::MotionClass::kNone:
      break;
  }
  return msg::MOTION_NONE;
}

msg::HitRule rule_of(percept::HitRule rule) {
  switch (rule) {
    case percept::HitRule::kVeryClose:
      return msg::HIT_VERY_CLOSE;
    case percept::HitRule::kModerateMoving:
      return msg::HIT_MODERATE_MOVING;
    case percept::HitRule::kFarNearing:
      return msg::HIT_FAR_NEARING;
    case percept::HitRule::kNone:
      break;
  }
  return msg::HIT_NONE;
}

template <class... Parts>
std::string text(const Parts&... parts) {
  std::ostringstream stream;
  (stream << ... << parts);
  return stream.str();
}

}  // namespace

std::string refusal(const msg::SlaveState& state, const robot::SerialArm& arm) {
  const std::size_t n = arm.joint_count();
  if (state.joint_count() != n)
    return text("joint_count is ", state.joint_count(), "; allowed: ", n, ", as the arm");
  if (state.stamp().sequence_number() == 0) return "stamp.sequence_number is 0; allowed: 1 or more";
  for (std::size_t i = 0; i < n; ++i) {
    const robot::Joint& joint = arm.joints()[i];
    const double q = state.position_rad()[i], v = state.velocity_rad_s()[i];
    if (!std::isfinite(q)) return text("position_rad[", i, "] (", joint.name, ") is not finite");
    if (!std::isfinite(v)) return text("velocity_rad_s[", i, "] (", joint.name, ") is not finite");
    const double tolerance = kRangeTolerance * (joint.upper - joint.lower);
    if (std::isfinite(tolerance) && (q < joint.lower - tolerance || q > joint.upper + tolerance)) {
      return text("position_rad[", i, "] (", joint.name, ") is ", q, "; allowed: ", joint.lower, " to ",
                  joint.upper, " and 5 % of that range beyond");
    }
  }
  return {};
}

SlaveSample sample_of(const msg::SlaveState& state, core::Nanoseconds received_ns) {
  SlaveSample sample;
  sample.id = {state.stamp().sequence_number(), state.stamp().monotonic_ns(), state.stamp().session()};
  const msg::Echo& echo = state.master_echo();
  sample.master_echo = {echo.sequence_number(), echo.monotonic_ns(), echo.session()};
  sample.received_ns = received_ns;
  const std::size_t n = std::min<std::size_t>(state.joint_count(), core::kMaxJoints);
  std::copy_n(state.position_rad().begin(), n, sample.position.begin());
  std::copy_n(state.velocity_rad_s().begin(), n, sample.velocity.begin());
  return sample;
}

voxel::VersionDescription description_of(const msg::WorkspaceVersion& version) {
  voxel::VersionDescription description;
  description.version = version.version();
  const msg::Vector3& origin = version.origin_m();
  description.grid = {
      {origin.x(), origin.y(), origin.z()},
      version.voxel_size_m(),
      {static_cast<std::int32_t>(version.size_x_vox()), static_cast<std::int32_t>(version.size_y_vox()),
       static_cast<std::int32_t>(version.size_z_vox())}};
  description.palette_Pa_s_per_m = version.palette();
  description.brick_count = version.brick_count();
  description.content_hash = version.content_hash();
  return description;
}

void fill(msg::DragField& message, const StepOutputs& outputs, const TickInfo& info,
          std::size_t joint_count) {
  message.slave_echo(echo_of(info.slave.id));
  message.master_echo(echo_of(info.slave.master_echo));
  message.workspace_version(outputs.workspace_version);
  message.joint_count(static_cast<std::uint32_t>(joint_count));
  message.coefficient_plus(outputs.drag.plus);
  message.coefficient_minus(outputs.drag.minus);
  message.coupled(outputs.drag.coupled);
  message.valid(outputs.valid);
  message.model_age_s(info.model_age_s);
}

void fill(msg::Percept& message, const StepOutputs& outputs, const TickInfo& info, std::size_t joint_count) {
  const SkinPercept& percept = outputs.percept;
  message.slave_echo(echo_of(info.slave.id));
  message.workspace_version(outputs.workspace_version);
  message.valid(outputs.valid);
  message.mu(static_cast<double>(percept.worst.mu));
  message.closeness(percept.closeness);
  message.speed_m_s(percept.velocity_W_m_s.norm());
  message.position_m(vector_of(percept.worst.position_W_m));
  message.velocity_m_s(vector_of(percept.velocity_W_m_s));
  message.pgv(vector_of(percept.gradient.pgv_W_m));
  message.pgs(percept.gradient.strength);
  message.motion(motion_of(percept.motion));
  message.link(static_cast<std::uint32_t>(percept.worst.link));
  message.sensor(static_cast<std::uint32_t>(percept.worst.sensor));
  message.object(percept.worst.object);
  message.joint_count(static_cast<std::uint32_t>(joint_count));
  message.drag_torque_Nm(percept.drag_torque);
  message.tick_s(info.tick_s);
}

void fill(msg::HitAlert& message, const percept::Alert& alert, bool cleared, const robot::SerialArm& arm) {
  message.alert(alert.number);
  message.rule(rule_of(alert.rule));
  message.link(alert.at.link);
  message.link_name(arm.links()[alert.at.link].name.substr(0, 64));
  message.sensor(alert.at.sensor);
  message.object(alert.at.object);
  message.look_at_m(vector_of(alert.at.position_W_m));
  message.pgv(vector_of(alert.at.pgv_W_m));
  message.speed_m_s(alert.at.situation.speed_m_s);
  message.mu(alert.at.situation.mu);
  message.cleared(cleared);
}

}  // namespace phantom::phantom_sensing
