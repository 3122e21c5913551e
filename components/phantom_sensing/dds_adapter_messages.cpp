#include "components/phantom_sensing/dds_adapter_messages.hpp"

#include <cmath>

#include "common/core/utf8.hpp"

namespace phantom::phantom_sensing {
namespace {

/// Returns a message with the fields that all percepts of one tick share.
template <class Message>
Message of_tick(const StepOutputs& outputs, const TickInfo& info) {
  Message message;
  message.slave_echo = info.slave.stamp;
  message.workspace_version = outputs.workspace_version;
  if constexpr (requires { message.condition; }) {
    message.valid = outputs.valid;
    message.condition = info.condition;
  }
  return message;
}

/// Fills the fields of a place's percept: of the whole skin or of an interest point.
template <class Message>
void apply_thread_config(const PlacePercept& place, Message& message) {
  message.mu_Pa_s_per_m = place.mu;
  message.closeness = place.closeness;
  message.speed_m_s = place.velocity_W_m_s.norm();
  message.position_m = messages::vector_of(place.position_W_m);
  message.velocity_m_s = messages::vector_of(place.velocity_W_m_s);
  message.pgv = messages::vector_of(place.gradient.pgv_W_m);
  message.pgs = place.gradient.strength;
  message.motion = place.motion;
  message.object = place.object;
}

messages::Threat threat_of(const Threat& threat) {
  messages::Threat message;
  apply_thread_config(threat, message);
  message.rule = threat.rule;
  message.raises = threat.raises;
  message.link = static_cast<std::uint32_t>(threat.link);
  message.sensor = static_cast<std::uint32_t>(threat.sensor);
  message.contact = threat.contact;
  return message;
}

}  // namespace

messages::DragField drag_field_of(const StepOutputs& outputs, const TickInfo& info, std::size_t joint_count) {
  auto field = of_tick<messages::DragField>(outputs, info);
  field.master_echo = info.slave.master_echo;
  field.gripper_echo = info.gripper;
  field.mode = outputs.drag_mode;
  field.joint_count = static_cast<std::uint32_t>(joint_count);
  field.drag = {outputs.drag, outputs.valid};
  field.reaction = outputs.reaction;
  field.model_age_s = info.model_age_s;
  return field;
}

messages::Percept percept_of(const StepOutputs& outputs, const TickInfo& info, std::size_t joint_count) {
  auto percept = of_tick<messages::Percept>(outputs, info);
  apply_thread_config(outputs.percept, percept);
  percept.link = static_cast<std::uint32_t>(outputs.percept.link);
  percept.sensor = static_cast<std::uint32_t>(outputs.percept.sensor);
  percept.joint_count = static_cast<std::uint32_t>(joint_count);
  percept.drag_torque_Nm = outputs.percept.drag_torque;
  percept.tick_s = info.tick_s;
  percept.muted_sensors = static_cast<std::uint32_t>(outputs.muted_sensors);
  percept.allowed_contacts = static_cast<std::uint16_t>(info.allowed_contacts);
  percept.greatest_mu_Pa_s_per_m = outputs.worst.mu;
  percept.greatest_closeness = outputs.worst.closeness;
  for (const Threat& threat : outputs.threats) percept.threats.push_back(threat_of(threat));
  return percept;
}

messages::InterestPoints interest_points_of(const StepOutputs& outputs, const TickInfo& info,
                                            const PhantomModel& model) {
  auto message = of_tick<messages::InterestPoints>(outputs, info);
  message.points.resize(outputs.interest.size());
  for (std::size_t i = 0; i < outputs.interest.size(); ++i) {
    messages::InterestPoint& point = message.points[i];
    apply_thread_config(outputs.interest[i], point);
    point.name = model.interest_points[i].name;
    point.link = static_cast<std::uint32_t>(model.interest_points[i].link);
    point.rule = outputs.interest[i].rule;
    point.muted = outputs.interest[i].muted;
  }
  return message;
}

messages::HitAlert hit_alert_of(const percept::Alert& alert, bool cleared, const PhantomModel& model) {
  messages::HitAlert message;
  message.alert = alert.number;
  message.rule = alert.rule;
  message.link = alert.at.link;
  message.link_name = model.arm.links()[alert.at.link].name;
  message.sensor = alert.at.sensor;
  message.object = alert.at.object;
  message.look_at_m = messages::vector_of(alert.at.position_W_m);
  message.pgv = messages::vector_of(alert.at.pgv_W_m);
  message.speed_m_s = alert.at.situation.speed_m_s;
  message.mu_Pa_s_per_m = alert.at.situation.mu;
  message.cleared = cleared;
  message.contact = alert.at.contact;
  if (alert.at.interest_point >= 0)
    message.interest_point = model.interest_points[static_cast<std::size_t>(alert.at.interest_point)].name;
  return message;
}

messages::ModelDoubt model_doubt_of(const percept::ModelDoubt& doubt, bool holds, const PhantomModel& model) {
  const percept::DoubtEvidence& at = doubt.at;
  messages::ModelDoubt message;
  message.place = doubt.place;
  message.doubt = doubt.number;
  message.kind = at.kind;
  message.holds = holds;
  message.workspace_version = at.workspace_version;
  message.link = at.link;
  message.link_name = model.arm.links()[at.link].name;
  message.object = at.object;
  message.position_m = messages::vector_of(at.position_W_m);
  message.located = at.located;
  message.force_N = at.force_N;
  message.residual_known = std::isfinite(at.residual_m);
  if (message.residual_known) message.residual_m = at.residual_m;
  message.shift_m = messages::vector_of(at.shift_W_m);
  return message;
}

}  // namespace phantom::phantom_sensing
