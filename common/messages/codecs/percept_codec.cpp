#include "common/messages/codecs/percept_codec.hpp"

#include <algorithm>
#include <cmath>

#include "common/messages/codecs/fields_codec.hpp"

namespace phantom::messages {
namespace {

using percept::HitRule;
using percept::MotionClass;

constexpr double kFastest_m_s = 100.0;                      // faster than any arm
constexpr std::size_t kMaxPoints = 32, kMaxPatches = 1024;  // as in the IDL
constexpr double kMaxPermit_s = 86400.0, kMaxObjectId = 65534.0;
constexpr double kFinestPatch_m = 1e-6, kWidestPatch_m = 10.0;

/// The fields that all percepts of one tick share.
constexpr auto kTick = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.echo(m.slave_echo(), s.slave_echo);
  codec.any(m.workspace_version(), s.workspace_version);
  codec.any(m.valid(), s.valid);
};

/// The fields of a place's percept: of the whole skin or of an interest point.
constexpr auto kPlace = [](auto& codec, auto& m, auto& s) {
  codec.number("mu", m.mu(), s.mu_Pa_s_per_m, 0.0);
  codec.number("closeness", m.closeness(), s.closeness, 0.0, 1.0);
  codec.number("speed_m_s", m.speed_m_s(), s.speed_m_s, 0.0, kFastest_m_s);
  codec.place("position_m", m.position_m(), s.position_m);
  codec.place("velocity_m_s", m.velocity_m_s(), s.velocity_m_s);
  codec.place("pgv", m.pgv(), s.pgv);
  codec.number("pgs", m.pgs(), s.pgs);
  codec.enumeration("motion", m.motion(), s.motion, MotionClass::kDangerous);
};

constexpr auto kDragField = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.echo(m.slave_echo(), s.slave_echo);
  codec.echo(m.master_echo(), s.master_echo);
  codec.echo(m.gripper_echo(), s.gripper_echo);
  codec.any(m.workspace_version(), s.workspace_version);
  codec.enumeration("mode", m.mode(), s.mode, teleop::DragMode::kCoupled);
  codec.joint_count(m.joint_count(), s.joint_count);
  codec.joints("coefficient_plus", m.coefficient_plus(), s.drag.plus, 0.0);
  codec.joints("coefficient_minus", m.coefficient_minus(), s.drag.minus, 0.0);
  codec.any(m.coupled(), s.drag.coupled);
  codec.joints("drift", m.drift(), s.drag.drift);
  codec.joints("reaction", m.reaction(), s.reaction.torque);
  codec.joints("reaction_stiffness", m.reaction_stiffness(), s.reaction.stiffness, 0.0);
  codec.joints("reaction_position", m.reaction_position(), s.reaction.position);
  codec.any(m.valid(), s.drag.valid);
  codec.number("model_age_s", m.model_age_s(), s.model_age_s);
};

constexpr double kUnknown = -1.0;  // of a time or a gap

constexpr auto kContact = [](auto& codec, auto& m, auto& s) {
  codec.number("time_to_contact_s", m.time_to_contact_s(), s.contact.time_s, kUnknown);
  codec.number("time_to_contact_error_s", m.time_to_contact_error_s(), s.contact.error_s, kUnknown);
  codec.number("gap_m", m.gap_m(), s.contact.gap_m, kUnknown);
};

constexpr auto kThreat = [](auto& codec, auto& m, auto& s) {
  codec.enumeration("rule", m.rule(), s.rule, HitRule::kFarNearing);
  codec.any(m.alerts(), s.raises);
  codec.link(m.link(), s.link);
  codec.any(m.sensor(), s.sensor);
  codec.any(m.object(), s.object);
  kPlace(codec, m, s);
  kContact(codec, m, s);
};

constexpr auto kPercept = [](auto& codec, auto& m, auto& s) {
  kTick(codec, m, s);
  codec.enumeration("condition", m.condition(), s.condition, PerceptCondition::kSelfTestFailed);
  kPlace(codec, m, s);
  codec.link(m.link(), s.link);
  codec.any(m.sensor(), s.sensor);
  codec.any(m.object(), s.object);
  codec.joint_count(m.joint_count(), s.joint_count);
  codec.joints("drag_torque_Nm", m.drag_torque_Nm(), s.drag_torque_Nm);
  codec.number("tick_s", m.tick_s(), s.tick_s);
  codec.any(m.muted_sensors(), s.muted_sensors);
  codec.any(m.allowed_contacts(), s.allowed_contacts);
  codec.number("greatest_mu", m.greatest_mu(), s.greatest_mu_Pa_s_per_m, 0.0);
  codec.number("greatest_closeness", m.greatest_closeness(), s.greatest_closeness, 0.0, 1.0);
  codec.list(m.threats(), s.threats, kThreat, kMaxThreats);
};

constexpr auto kInterestPoint = [](auto& codec, auto& m, auto& s) {
  codec.any(m.name(), s.name);
  codec.link(m.link(), s.link);
  kPlace(codec, m, s);
  codec.enumeration("rule", m.rule(), s.rule, HitRule::kFarNearing);
  codec.any(m.object(), s.object);
  codec.any(m.muted(), s.muted);
};

constexpr auto kInterestPoints = [](auto& codec, auto& m, auto& s) {
  kTick(codec, m, s);
  codec.enumeration("condition", m.condition(), s.condition, PerceptCondition::kSelfTestFailed);
  codec.list(m.points(), s.points, kInterestPoint, kMaxPoints);
};

constexpr auto kSkinPatch = [](auto& codec, auto& m, auto& s) {
  codec.link(m.link(), s.link);
  codec.number("x_m", m.x_m(), s.middle_m[0]);
  codec.number("y_m", m.y_m(), s.middle_m[1]);
  codec.number("z_m", m.z_m(), s.middle_m[2]);
  codec.number("mu", m.mu(), s.mu_Pa_s_per_m, 0.0);
};

constexpr auto kSkinPercept = [](auto& codec, auto& m, auto& s) {
  kTick(codec, m, s);
  codec.number("patch_m", m.patch_m(), s.patch_m, kFinestPatch_m, kWidestPatch_m);
  codec.number("greatest_mu", m.greatest_mu(), s.greatest_mu_Pa_s_per_m);
  codec.any(m.patch_count(), s.patch_count);
  codec.list(m.felt(), s.felt, kSkinPatch, kMaxPatches);
};

constexpr auto kHitAlert = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.any(m.stamp().utc_ns(), s.utc_ns);
  codec.number("alert", m.alert(), s.alert, 1.0);
  codec.enumeration("rule", m.rule(), s.rule, HitRule::kFarNearing);
  codec.link(m.link(), s.link);
  codec.any(m.link_name(), s.link_name);
  codec.any(m.sensor(), s.sensor);
  codec.any(m.object(), s.object);
  codec.place("look_at_m", m.look_at_m(), s.look_at_m);
  codec.place("pgv", m.pgv(), s.pgv);
  codec.number("speed_m_s", m.speed_m_s(), s.speed_m_s);
  codec.number("mu", m.mu(), s.mu_Pa_s_per_m);
  codec.any(m.cleared(), s.cleared);
  codec.any(m.interest_point(), s.interest_point);
  kContact(codec, m, s);
};

constexpr auto kSensingCommand = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.any(m.requester(), s.requester);
  codec.enumeration("request", m.request(), s.request, SensingRequest::kListContacts);
  codec.name("object", m.object(), s.object);
  codec.number("id", m.id(), s.id, 0.0, kMaxObjectId);
  codec.name("link", m.link(), s.link);
  codec.number("duration_s", m.duration_s(), s.duration_s, 0.0, kMaxPermit_s);
};

constexpr auto kSensingReply = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.echo(m.command(), s.command);
  codec.any(m.requester(), s.requester);
  codec.enumeration("request", m.request(), s.request, SensingRequest::kListContacts);
  codec.any(m.done(), s.done);
  codec.any(m.message(), s.message);
};

}  // namespace

core::Status read(const msg::SensingCommand& message, SensingCommand& command) {
  const core::Status status = decode(kSensingCommand, message, {}, command);
  const bool names_object = !command.object.empty() || command.id != 0;
  if (!status || command.request != SensingRequest::kAllowContact || names_object) return status;
  return core::Status::invalid_argument(
      "object is empty and id is 0; allowed: a name, or an id of 1 to 65534");
}

core::Expected<SensingCommand> from_idl(const msg::SensingCommand& message, const ArmBounds&) {
  return read_whole<SensingCommand>(message);
}
core::Expected<SensingReply> from_idl(const msg::SensingReply& message, const ArmBounds& arm) {
  return decoded<SensingReply>(kSensingReply, message, arm);
}
core::Expected<DragField> from_idl(const msg::DragField& message, const ArmBounds& arm) {
  auto field = decoded<DragField>(kDragField, message, arm);
  if (!field || field->mode != teleop::DragMode::kCoupled) return field;
  const auto used = static_cast<std::ptrdiff_t>(field->joint_count * (field->joint_count + 1) / 2);
  const auto& entries = field->drag.coupled;
  if (!std::all_of(entries.begin(), entries.begin() + used, [](double d) { return std::isfinite(d); }))
    return core::Status::invalid_argument("an entry of the drag matrix `coupled` is not finite");
  return field;
}
core::Expected<Percept> from_idl(const msg::Percept& message, const ArmBounds& arm) {
  return decoded<Percept>(kPercept, message, arm);
}
core::Expected<InterestPoints> from_idl(const msg::InterestPoints& message, const ArmBounds& arm) {
  return decoded<InterestPoints>(kInterestPoints, message, arm);
}
core::Expected<SkinPercept> from_idl(const msg::SkinPercept& message, const ArmBounds& arm) {
  return decoded<SkinPercept>(kSkinPercept, message, arm);
}
core::Expected<HitAlert> from_idl(const msg::HitAlert& message, const ArmBounds& arm) {
  return decoded<HitAlert>(kHitAlert, message, arm);
}
msg::DragField to_idl(const DragField& field) { return encoded<msg::DragField>(kDragField, field); }
msg::Percept to_idl(const Percept& percept) { return encoded<msg::Percept>(kPercept, percept); }
msg::InterestPoints to_idl(const InterestPoints& points) {
  return encoded<msg::InterestPoints>(kInterestPoints, points);
}
msg::SkinPercept to_idl(const SkinPercept& skin) { return encoded<msg::SkinPercept>(kSkinPercept, skin); }
msg::HitAlert to_idl(const HitAlert& alert) { return encoded<msg::HitAlert>(kHitAlert, alert); }
msg::SensingCommand to_idl(const SensingCommand& command) {
  return encoded<msg::SensingCommand>(kSensingCommand, command);
}
msg::SensingReply to_idl(const SensingReply& reply) {
  return encoded<msg::SensingReply>(kSensingReply, reply);
}

}  // namespace phantom::messages
