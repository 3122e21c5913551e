#include "components/phantom_sensing/dds_adapter_messages.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "common/robot/joint_values.hpp"

namespace phantom::phantom_sensing {
namespace {

constexpr std::size_t kPointNameBound = 32;  // idl: string<32>

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

msg::PerceptCondition condition_of(PerceptCondition condition) {
  switch (condition) {
    case PerceptCondition::kFresh:
      return msg::PERCEPT_FRESH;
    case PerceptCondition::kWorkspaceUnattended:
      return msg::PERCEPT_WORKSPACE_UNATTENDED;
    case PerceptCondition::kWorkspaceBehind:
      return msg::PERCEPT_WORKSPACE_BEHIND;
    case PerceptCondition::kWorkspaceStale:
      return msg::PERCEPT_WORKSPACE_STALE;
    case PerceptCondition::kNoWorkspace:
      return msg::PERCEPT_NO_WORKSPACE;
    case PerceptCondition::kNoState:
      return msg::PERCEPT_NO_STATE;
    case PerceptCondition::kStateStale:
      return msg::PERCEPT_STATE_STALE;
    case PerceptCondition::kSelfTestFailed:
      break;
  }
  return msg::PERCEPT_SELF_TEST_FAILED;
}

msg::DragMode mode_of(robot::DragMode mode) {
  return mode == robot::DragMode::kCoupled ? msg::DRAG_COUPLED : msg::DRAG_SEPARABLE;
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
    if (!robot::near_limits(q, joint.lower, joint.upper)) {
      return text("position_rad[", i, "] (", joint.name, ") is ", q, "; allowed: ", joint.lower, " to ",
                  joint.upper, " and ", 100.0 * robot::kLimitMarginShare, " % of that range beyond");
    }
  }
  return {};
}

SlaveSample sample_of(const msg::SlaveState& state, core::Nanoseconds received_ns) {
  SlaveSample sample;
  sample.id = dds::id_of(state.stamp());
  sample.master_echo = dds::id_of(state.master_echo());
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
  message.slave_echo(dds::echo_of(info.slave.id));
  message.master_echo(dds::echo_of(info.slave.master_echo));
  message.workspace_version(outputs.workspace_version);
  message.mode(mode_of(outputs.drag_mode));
  message.joint_count(static_cast<std::uint32_t>(joint_count));
  message.coefficient_plus(outputs.drag.plus);
  message.coefficient_minus(outputs.drag.minus);
  message.coupled(outputs.drag.coupled);
  message.valid(outputs.valid);
  message.model_age_s(info.model_age_s);
}

void fill(msg::Percept& message, const StepOutputs& outputs, const TickInfo& info, std::size_t joint_count) {
  const SkinPercept& percept = outputs.percept;
  message.slave_echo(dds::echo_of(info.slave.id));
  message.workspace_version(outputs.workspace_version);
  message.valid(outputs.valid);
  message.condition(condition_of(info.condition));
  message.mu(percept.mu);
  message.closeness(percept.closeness);
  message.speed_m_s(percept.velocity_W_m_s.norm());
  message.position_m(vector_of(percept.position_W_m));
  message.velocity_m_s(vector_of(percept.velocity_W_m_s));
  message.pgv(vector_of(percept.gradient.pgv_W_m));
  message.pgs(percept.gradient.strength);
  message.motion(motion_of(percept.motion));
  message.link(static_cast<std::uint32_t>(percept.link));
  message.sensor(static_cast<std::uint32_t>(percept.sensor));
  message.object(percept.object);
  message.joint_count(static_cast<std::uint32_t>(joint_count));
  message.drag_torque_Nm(percept.drag_torque);
  message.tick_s(info.tick_s);
  message.muted_sensors(static_cast<std::uint32_t>(outputs.muted_sensors));
  message.allowed_contacts(static_cast<std::uint16_t>(info.allowed_contacts));
}

void fill(msg::InterestPoints& message, const StepOutputs& outputs, const TickInfo& info,
          const PhantomModel& model) {
  message.slave_echo(dds::echo_of(info.slave.id));
  message.workspace_version(outputs.workspace_version);
  message.valid(outputs.valid);
  message.condition(condition_of(info.condition));
  message.points().resize(outputs.interest.size());
  for (std::size_t i = 0; i < outputs.interest.size(); ++i) {
    const InterestPercept& percept = outputs.interest[i];
    msg::InterestPoint& point = message.points()[i];
    point.name(model.interest_points[i].name.substr(0, kPointNameBound));
    point.link(static_cast<std::uint32_t>(model.interest_points[i].link));
    point.mu(percept.mu);
    point.closeness(percept.closeness);
    point.speed_m_s(percept.velocity_W_m_s.norm());
    point.position_m(vector_of(percept.position_W_m));
    point.velocity_m_s(vector_of(percept.velocity_W_m_s));
    point.pgv(vector_of(percept.gradient.pgv_W_m));
    point.pgs(percept.gradient.strength);
    point.motion(motion_of(percept.motion));
    point.rule(rule_of(percept.rule));
    point.object(percept.object);
    point.muted(percept.muted);
  }
}

void fill(msg::SkinPercept& message, const SkinView& view) {
  message.slave_echo(dds::echo_of(view.slave.id));
  message.workspace_version(view.workspace_version);
  message.valid(view.valid);
  message.patch_m(view.edge_m);
  message.greatest_mu(view.greatest_mu);
  message.patch_count(static_cast<std::uint32_t>(view.patch_count));
  message.felt().clear();
  for (const robot::SkinPatches::Patch& patch : view.felt) {
    msg::SkinPatch felt;
    felt.link(static_cast<std::uint32_t>(patch.link));
    felt.x_m(static_cast<float>(patch.middle_m.x()));
    felt.y_m(static_cast<float>(patch.middle_m.y()));
    felt.z_m(static_cast<float>(patch.middle_m.z()));
    felt.mu(patch.mu);
    message.felt().push_back(felt);
  }
}

void fill(msg::HitAlert& message, const percept::Alert& alert, bool cleared, const PhantomModel& model) {
  message.alert(alert.number);
  message.rule(rule_of(alert.rule));
  message.link(alert.at.link);
  message.link_name(model.arm.links()[alert.at.link].name.substr(0, 64));
  message.sensor(alert.at.sensor);
  message.object(alert.at.object);
  message.look_at_m(vector_of(alert.at.position_W_m));
  message.pgv(vector_of(alert.at.pgv_W_m));
  message.speed_m_s(alert.at.situation.speed_m_s);
  message.mu(alert.at.situation.mu);
  message.cleared(cleared);
  const std::int32_t point = alert.at.interest_point;
  message.interest_point(
      point < 0 ? ""
                : model.interest_points[static_cast<std::size_t>(point)].name.substr(0, kPointNameBound));
}

ContactRequest contact_request_of(const msg::SensingCommand& command) {
  return {command.request() == msg::SENSING_ALLOW_CONTACT, command.object().to_string(), command.id(),
          command.link().to_string(), command.duration_s()};
}

msg::SensingCommand to_message(const SensingRequest& request, const std::string& requester) {
  constexpr std::size_t kNameBound = 64;  // idl
  for (const std::string& name : {request.contact.object, request.contact.link}) {
    if (name.size() > kNameBound)
      throw core::ConfigError("'" + name + "': allowed: a name of at most 64 bytes");
  }
  msg::SensingCommand command;
  command.requester(requester.substr(0, kNameBound));
  command.request(request.what == SensingRequest::What::kSelfTest       ? msg::SENSING_SELF_TEST
                  : request.what == SensingRequest::What::kListContacts ? msg::SENSING_LIST_CONTACTS
                  : request.contact.allow                               ? msg::SENSING_ALLOW_CONTACT
                                                                        : msg::SENSING_FORBID_CONTACT);
  command.object(request.contact.object);
  command.id(request.contact.id);
  command.link(request.contact.link);
  command.duration_s(request.contact.duration_s);
  return command;
}

msg::SensingReply reply_to(const msg::SensingCommand& command, const Answer& answer) {
  msg::SensingReply reply;
  reply.requester(command.requester());
  reply.request(command.request());
  reply.done(answer.done);
  reply.message(answer.message.substr(0, 1024));
  return reply;
}

}  // namespace phantom::phantom_sensing
