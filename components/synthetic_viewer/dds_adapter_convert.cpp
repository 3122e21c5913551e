// From the topics' messages to the viewer's own samples.

#include <algorithm>
#include <cmath>

#include "components/synthetic_viewer/commands.hpp"
#include "components/synthetic_viewer/dds_adapter.hpp"
#include "components/synthetic_viewer/mesh_assembler.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr double kFarthest_m = 1e4;  // beyond any cell: such a place is a fault

bool finite(std::initializer_list<double> values) {
  return std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); });
}

bool is_place(const msg::Vector3& v) {
  return std::abs(v.x()) <= kFarthest_m && std::abs(v.y()) <= kFarthest_m && std::abs(v.z()) <= kFarthest_m;
}

Vector3 vector_of(const msg::Vector3& v) { return {v.x(), v.y(), v.z()}; }

bool is_stamped(const msg::Stamp& stamp) { return stamp.sequence_number() > 0; }

/// Enumerations come off the wire unchecked; both lists have the same order.
template <class To, class From>
std::optional<To> enumerator(From value, To last) {
  const auto number = static_cast<std::int64_t>(value);
  if (number < 0 || number > static_cast<std::int64_t>(last)) return std::nullopt;
  return static_cast<To>(number);
}

bool all_finite(const core::JointArray& values) { return core::all_finite(values, values.size()); }

}  // namespace

std::optional<ArmSample> convert(const msg::SlaveState& message, const ArmShape& shape) {
  ArmSample sample;
  sample.position = message.position_rad();
  sample.velocity = message.velocity_rad_s();
  const auto state = enumerator(message.state(), LinkState::kStopped);
  const auto stop_cause = enumerator(message.stop_cause(), StopCause::kPartner);
  if (!is_stamped(message.stamp()) || !state || !stop_cause || message.joint_count() != shape.joint_count ||
      !all_finite(sample.position) || !all_finite(sample.velocity) || !is_place(message.contact_point_m()) ||
      !finite({message.contact_force_N(), message.tool_speed_m_s()})) {
    return std::nullopt;
  }
  sample.state = *state;
  sample.stop_cause = *stop_cause;
  sample.stop = message.stop();
  sample.contact = message.contact();
  sample.contact_force_N = message.contact_force_N();
  sample.contact_object = message.contact_object();
  sample.contact_point_m = vector_of(message.contact_point_m());
  sample.tool_speed_m_s = message.tool_speed_m_s();
  return sample;
}

std::optional<MasterSample> convert(const msg::MasterState& message, const ArmShape& shape) {
  MasterSample sample;
  sample.percept_torque_Nm = message.percept_torque_Nm();
  sample.feedback_torque_Nm = message.feedback_torque_Nm();
  const auto state = enumerator(message.state(), LinkState::kStopped);
  const auto stop_cause = enumerator(message.stop_cause(), StopCause::kPartner);
  if (!is_stamped(message.stamp()) || !state || !stop_cause || message.law() > msg::LAW_PEFF ||
      message.joint_count() != shape.joint_count || !all_finite(sample.percept_torque_Nm) ||
      !all_finite(sample.feedback_torque_Nm) || !(message.percept_gain() >= 0) ||
      !(message.feedback_gain() >= 0) ||
      !finite({message.percept_gain(), message.feedback_gain(), message.round_trip_s()})) {
    return std::nullopt;
  }
  sample.state = *state;
  sample.stop_cause = *stop_cause;
  sample.stop = message.stop();
  sample.percept_gain = message.percept_gain();
  sample.feedback_gain = message.feedback_gain();
  sample.percept_enabled = message.percept_enabled();
  sample.percept_limited = message.percept_limited();
  sample.law = message.law();
  sample.feedback_damped = message.feedback_damped();
  sample.force_missing = message.force_missing();
  sample.reach = message.reach();
  sample.round_trip_s = message.round_trip_s();
  return sample;
}

std::optional<PerceptSample> convert(const msg::Percept& message, const ArmShape& shape) {
  PerceptSample sample;
  sample.drag_torque_Nm = message.drag_torque_Nm();
  const auto motion = enumerator(message.motion(), MotionClass::kDangerous);
  if (!is_stamped(message.stamp()) || !motion || message.joint_count() != shape.joint_count ||
      message.link() >= shape.link_count || !all_finite(sample.drag_torque_Nm) ||
      !(message.closeness() >= 0 && message.closeness() <= 1) || !(message.mu() >= 0) ||
      !finite({message.mu(), message.speed_m_s()}) || !is_place(message.position_m()) ||
      !is_place(message.velocity_m_s()) || !is_place(message.pgv())) {
    return std::nullopt;
  }
  sample.valid = message.valid();
  sample.mu_Pa_s_per_m = message.mu();
  sample.closeness = message.closeness();
  sample.speed_m_s = message.speed_m_s();
  sample.position_m = vector_of(message.position_m());
  sample.velocity_m_s = vector_of(message.velocity_m_s());
  sample.pgv = vector_of(message.pgv());
  sample.motion = *motion;
  sample.link = message.link();
  sample.object = message.object();
  return sample;
}

std::optional<HitSample> convert(const msg::HitAlert& message, const ArmShape& shape) {
  const auto rule = enumerator(message.rule(), HitRule::kFarNearing);
  if (!is_stamped(message.stamp()) || !rule || message.alert() == 0 || message.link() >= shape.link_count ||
      !is_place(message.look_at_m()) || !is_place(message.pgv()) ||
      !finite({message.speed_m_s(), message.mu()})) {
    return std::nullopt;
  }
  HitSample sample;
  sample.utc_ns = message.stamp().utc_ns();
  sample.alert = message.alert();
  sample.rule = *rule;
  sample.link = message.link();
  sample.link_name = message.link_name().c_str();
  sample.object = message.object();
  sample.look_at_m = vector_of(message.look_at_m());
  sample.pgv = vector_of(message.pgv());
  sample.speed_m_s = message.speed_m_s();
  sample.mu_Pa_s_per_m = message.mu();
  sample.cleared = message.cleared();
  return sample;
}

std::optional<ObjectSample> convert(const msg::WorkspaceObject& message) {
  const msg::Pose& pose = message.X_WO();
  const Eigen::Vector4d quaternion(pose.qx(), pose.qy(), pose.qz(), pose.qw());
  const std::array<float, 3> colour{message.red(), message.green(), message.blue()};
  const bool good_colour =
      std::all_of(colour.begin(), colour.end(), [](float c) { return c >= 0 && c <= 1; });
  if (message.id() == 0 || message.id() == 65535 || !good_colour || !is_place(pose.position_m()) ||
      !(std::abs(quaternion.norm() - 1) <= 1e-3)) {
    return std::nullopt;
  }
  ObjectSample sample;
  sample.id = message.id();
  sample.name = message.name().c_str();
  sample.mesh_hash = message.mesh_hash();
  const Vector3 place = vector_of(pose.position_m());
  sample.X_WO = {geometry::rotation_from_quaternion(quaternion),
                 Eigen::Vector3d(place[0], place[1], place[2])};
  sample.colour = colour;
  return sample;
}

std::optional<WorkspaceSample> convert(const msg::WorkspaceVersion& message) {
  if (message.version() == 0 || !(message.voxel_size_m() > 0 && message.voxel_size_m() <= 1))
    return std::nullopt;
  return WorkspaceSample{message.version(), message.voxel_size_m()};
}

std::optional<SkinSample> convert(const msg::SkinPercept& message, const ArmShape& shape) {
  constexpr double kWidestPatch_m = 10.0;
  if (!is_stamped(message.stamp()) || !(message.patch_m() > 0 && message.patch_m() <= kWidestPatch_m) ||
      !std::isfinite(message.greatest_mu())) {
    return std::nullopt;
  }
  SkinSample sample;
  sample.valid = message.valid() && message.greatest_mu() > 0;
  sample.patch_m = message.patch_m();
  for (const msg::SkinPatch& patch : message.felt()) {
    if (patch.link() >= shape.link_count || !finite({patch.x_m(), patch.y_m(), patch.z_m()}) ||
        !(patch.mu() >= 0) || !std::isfinite(patch.mu())) {
      return std::nullopt;
    }
    if (!sample.valid) continue;
    const double closeness = std::min(1.0, static_cast<double>(patch.mu()) / message.greatest_mu());
    sample.felt.push_back(
        {patch.link(), {patch.x_m(), patch.y_m(), patch.z_m()}, static_cast<float>(closeness)});
  }
  return sample;
}

std::optional<MeshChunkSample> convert(const msg::MeshChunk& message) {
  MeshChunkSample sample{message.mesh_hash(),    message.chunk(),          message.chunk_count(),
                         message.vertex_count(), message.triangle_count(), message.data()};
  if (!check_chunk(sample).is_ok()) return std::nullopt;
  return sample;
}

std::optional<ComponentSample> convert(const msg::ComponentStatus& message) {
  const auto state = enumerator(message.state(), core::ComponentState::kFault);
  ComponentSample sample;
  sample.name = message.component_name().c_str();
  sample.host = message.host().c_str();
  sample.message = message.message().c_str();
  if (!is_stamped(message.stamp()) || !state || sample.name.empty()) return std::nullopt;
  sample.state = *state;
  for (const msg::LoopStatistics& loop : message.loops()) {
    if (!finite({loop.period_s(), loop.rate_hz(), loop.wakeup_p50_us(), loop.wakeup_p99_us(),
                 loop.wakeup_max_us(), loop.work_p50_us(), loop.work_max_us(), loop.idle_s()})) {
      return std::nullopt;
    }
    sample.loops.push_back({loop.name().c_str(), loop.period_s(), loop.rate_hz(), loop.wakeup_p50_us(),
                            loop.wakeup_p99_us(), loop.wakeup_max_us(), loop.work_p50_us(),
                            loop.work_max_us(), loop.ticks(), loop.slips(), loop.idle_s()});
  }
  for (const msg::Figure& figure : message.figures()) {
    sample.figures.push_back({figure.name().c_str(), figure.value(), figure.unit().c_str()});
  }
  for (const msg::TopicStatistics& topic : message.topics()) {
    sample.refused += topic.refused();
    sample.deadline_missed += topic.deadline_missed();
    sample.incompatible_qos += topic.incompatible_qos();
  }
  return sample;
}

std::optional<Command> convert(const msg::OperatorCommand& message) {
  const auto kind = enumerator(message.kind(), CommandKind::kMark);
  if (!is_stamped(message.stamp()) || !kind) return std::nullopt;
  const Command command{*kind, message.value()};
  if (!check_command(command).is_ok()) return std::nullopt;
  return command;
}

}  // namespace phantom::synthetic_viewer
