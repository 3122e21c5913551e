#include "common/messages/codecs/teleoperation_codec.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/printable.hpp"
#include "common/messages/codecs/fields_codec.hpp"
#include "common/percept/view_node.hpp"

namespace phantom::messages {
namespace {

using teleop::LinkState;
using teleop::StopCause;

constexpr double kMaxForce = 1e6;  // N or N·m

/// The fields that both sides' states have.
constexpr auto kSide = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.joint_count(m.joint_count(), s.joint_count);
  codec.enumeration("state", m.state(), s.state, LinkState::kStopped);
  codec.enumeration("stop_cause", m.stop_cause(), s.stop.cause, StopCause::kPartner);
  codec.any(m.stop(), s.stop.id);
  codec.any(m.enabling_switch_fitted(), s.switch_fitted);
  codec.any(m.motion_permitted(), s.motion_permitted);
  codec.positions("position_rad", m.position_rad(), s.position);
  codec.joints("velocity_rad_s", m.velocity_rad_s(), s.velocity);
};

constexpr auto kSlaveState = [](auto& codec, auto& m, auto& s) {
  kSide(codec, m, s);
  codec.echo(m.master_echo(), s.master_echo);
  codec.joints("loop_torque_Nm", m.loop_torque_Nm(), s.loop_torque_Nm);
  codec.enumeration("counterbalance", m.counterbalance(), s.counterbalance,
                    teleop::Counterbalance::kAutomatic);
  codec.any(m.external_torque_measured(), s.force_measured);
  codec.joints("external_torque_Nm", m.external_torque_Nm(), s.external_torque_Nm);
  codec.any(m.contact(), s.contact);
  codec.number("contact_force_N", m.contact_force_N(), s.contact_force_N);
  codec.any(m.contact_object(), s.contact_object);
  codec.place("contact_point_m", m.contact_point_m(), s.contact_point_m);
  codec.number("tool_speed_m_s", m.tool_speed_m_s(), s.tool_speed_m_s);
  codec.number("clearance_m", m.clearance_m(), s.clearance_m);
};

constexpr auto kGripperState = [](auto& codec, auto& m, auto& s) {
  constexpr double kWidest_m = 1.0, kBeyond_m = 0.01, kMax_N = 10'000.0, kAboveZero = 1e-9;
  codec.stamp(m.stamp(), s.stamp);
  codec.number("width_m", m.width_m(), s.sense.width_m, -kBeyond_m, kWidest_m + kBeyond_m);
  codec.number("velocity_m_s", m.velocity_m_s(), s.sense.velocity_m_s);
  codec.number("force_N", m.force_N(), s.sense.force_N);
  codec.number("requested_width_m", m.requested_width_m(), s.requested_width_m, 0.0, kWidest_m);
  codec.number("requested_force_N", m.requested_force_N(), s.requested_force_N, kAboveZero, kMax_N);
  codec.number("widest_m", m.widest_m(), s.widest_m, kAboveZero, kWidest_m);
  codec.number("least_force_N", m.least_force_N(), s.least_force_N, kAboveZero, kMax_N);
  codec.number("greatest_force_N", m.greatest_force_N(), s.greatest_force_N, kAboveZero, kMax_N);
  codec.any(m.known(), s.sense.known);
  codec.any(m.follows(), s.sense.follows);
  codec.any(m.fault(), s.sense.fault);
  codec.any(m.moves(), s.moves);
  codec.any(m.holds(), s.holds);
  codec.any(m.open(), s.open);
  codec.any(m.closed(), s.closed);
};

constexpr auto kMasterState = [](auto& codec, auto& m, auto& s) {
  kSide(codec, m, s);
  codec.enumeration("law", m.law(), s.law, teleop::BilateralLaw::kPeff);
  codec.joints("percept_torque_Nm", m.percept_torque_Nm(), s.percept_torque_Nm);
  codec.joints("feedback_torque_Nm", m.feedback_torque_Nm(), s.feedback_torque_Nm);
  codec.joints("operator_torque_Nm", m.operator_torque_Nm(), s.operator_torque_Nm);
  codec.number("percept_gain", m.percept_gain(), s.percept_gain, 0.0);
  codec.number("feedback_gain", m.feedback_gain(), s.feedback_gain, 0.0);
  codec.any(m.percept_enabled(), s.percept_enabled);
  codec.any(m.drag_chosen(), s.drag_chosen);
  codec.any(m.tone_enabled(), s.tone_enabled);
  codec.any(m.views_enabled(), s.views_enabled);
  codec.any(m.percept_set_automatic(), s.percept_set_automatic);
  codec.any(m.percept_limited(), s.percept_limited);
  codec.any(m.feedback_limited(), s.feedback_limited);
  codec.any(m.feedback_damped(), s.feedback_damped);
  codec.any(m.force_missing(), s.force_missing);
  codec.any(m.reach(), s.reach);
  codec.echo(m.slave_echo(), s.slave_echo);
  codec.echo(m.drag_echo(), s.drag_echo);
  codec.number("round_trip_s", m.round_trip_s(), s.round_trip_s);
};

constexpr auto kWristWrench = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.any(m.valid(), s.valid);
  codec.vector("force_N", m.force_N(), s.force_N, kMaxForce);
  codec.vector("torque_Nm", m.torque_Nm(), s.torque_Nm, kMaxForce);
};

constexpr auto kViewPose = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.enumeration("view", m.view(), s.hit_zone, true);
  codec.number("node", m.node(), s.node, 0.0, percept::kNodeCount);
  codec.any(m.automatic(), s.automatic);
  codec.pose("X_WC", m.X_WC(), s.X_WC);
  codec.place("look_at_m", m.look_at_m(), s.look_at_m);
};

constexpr auto kViewPicture = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.enumeration("view", m.view(), s.view, PictureView::kCamera);
  codec.any(m.jpeg(), s.jpeg);
};

constexpr auto kCameraPicture = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.name("camera", m.camera(), s.camera);
  codec.number("exposed_utc_ns", m.exposed_utc_ns(), s.exposed_utc_ns, 0.0, 9.2e18);
  codec.number("width", m.width(), s.width, kMinPictureSide_px, kMaxPictureSide_px);
  codec.number("height", m.height(), s.height, kMinPictureSide_px, kMaxPictureSide_px);
  codec.any(m.jpeg(), s.jpeg);
};

constexpr auto kSensorPoints = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.number("measured_utc_ns", m.measured_utc_ns(), s.measured_utc_ns, 0.0, 9.2e18);
  codec.name("frame", m.frame(), s.frame);
  codec.number("width", m.width(), s.width, 1.0, static_cast<double>(kMaxSensorPoints));
  codec.number("height", m.height(), s.height, 1.0, static_cast<double>(kMaxSensorPoints));
  codec.any(m.xyz_m(), s.xyz_m);
};

core::Status check_jpeg(std::size_t octets) {
  if (octets > 0 && octets <= kMaxPictureBytes) return core::Status::ok();
  return core::Status::invalid_argument("jpeg has " + std::to_string(octets) + " octets; allowed: 1 to " +
                                        std::to_string(kMaxPictureBytes));
}

/// Returns why the points are none; empty if they are.
std::string refusal(const SensorPoints& points) {
  const std::uint64_t count = std::uint64_t{points.width} * points.height;
  if (count > kMaxSensorPoints)
    return "width·height is " + std::to_string(count) + "; allowed: at most " +
           std::to_string(kMaxSensorPoints);
  if (points.xyz_m.size() != 3 * count)
    return "xyz_m has " + std::to_string(points.xyz_m.size()) + " values; allowed: 3·width·height";
  for (std::size_t i = 0; i < points.xyz_m.size(); i += 3) {
    const float* p = points.xyz_m.data() + i;
    const bool none = std::isnan(p[0]) && std::isnan(p[1]) && std::isnan(p[2]);
    const auto near = [](float x) { return std::abs(x) <= kFarthest_m; };
    if (!none && !std::all_of(p, p + 3, near))
      return "xyz_m has a point that is none or too far; allowed: within 10000 m, or three times NaN";
  }
  return "";
}

constexpr auto kOperatorCommand = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.enumeration("kind", m.kind(), s.kind, teleop::kLastCommandKind);
  codec.any(m.value(), s.value);
  codec.any(m.joint(), s.joint);
  codec.any(m.master_stop(), s.master_stop);
  codec.any(m.slave_stop(), s.slave_stop);
  codec.any(m.issuer(), s.issuer);
};

constexpr auto kOperatorReply = [](auto& codec, auto& m, auto& s) {
  codec.stamp(m.stamp(), s.stamp);
  codec.echo(m.command(), s.command);
  codec.name("component_name", m.component_name(), s.component);
  codec.enumeration("kind", m.kind(), s.kind, teleop::kLastCommandKind);
  codec.any(m.done(), s.done);
  codec.any(m.message(), s.message);
};

/// Returns why the command's fields do not fit together; empty if they do. A stop or a reset is never refused
/// for a joint, which it does not use, nor a stop for its issuer, which the log escapes.
std::string refusal(const OperatorCommand& command) {
  using teleop::CommandKind;
  const bool sets_gain =
      command.kind == CommandKind::kSetPerceptGain || command.kind == CommandKind::kSetFeedbackGain;
  if (sets_gain && (command.joint < -1 || command.joint >= static_cast<int>(core::kMaxJoints)))
    return "joint is " + std::to_string(command.joint) + "; allowed: -1 (all) to 15";
  if (command.kind != CommandKind::kEmergencyStop && !core::is_printable(command.issuer))
    return "issuer has control characters; allowed: one line of text";
  return teleop::value_refusal(command.kind, command.value);
}

}  // namespace

core::Status read(const msg::OperatorCommand& message, OperatorCommand& command) {
  const core::Status status = decode(kOperatorCommand, message, {}, command);
  if (!status) return status;
  const std::string why = refusal(command);
  return why.empty() ? core::Status::ok() : core::Status::invalid_argument(why);
}

core::Expected<OperatorCommand> from_idl(const msg::OperatorCommand& message, const ArmBounds&) {
  return read_whole<OperatorCommand>(message);
}
core::Expected<OperatorReply> from_idl(const msg::OperatorReply& message, const ArmBounds& arm) {
  return decoded<OperatorReply>(kOperatorReply, message, arm);
}
core::Expected<SlaveState> from_idl(const msg::SlaveState& message, const ArmBounds& arm) {
  return decoded<SlaveState>(kSlaveState, message, arm);
}
core::Expected<MasterState> from_idl(const msg::MasterState& message, const ArmBounds& arm) {
  return decoded<MasterState>(kMasterState, message, arm);
}
core::Expected<GripperState> from_idl(const msg::GripperState& message, const ArmBounds& arm) {
  return decoded<GripperState>(kGripperState, message, arm);
}
core::Expected<WristWrench> from_idl(const msg::WristWrench& message, const ArmBounds& arm) {
  return decoded<WristWrench>(kWristWrench, message, arm);
}
core::Expected<ViewPose> from_idl(const msg::ViewPose& message, const ArmBounds& arm) {
  return decoded<ViewPose>(kViewPose, message, arm);
}
core::Expected<ViewPicture> from_idl(const msg::ViewPicture& message, const ArmBounds& arm) {
  if (const core::Status status = check_jpeg(message.jpeg().size()); !status) return status;
  return decoded<ViewPicture>(kViewPicture, message, arm);
}
core::Expected<CameraPicture> from_idl(const msg::CameraPicture& message, const ArmBounds& arm) {
  if (const core::Status status = check_jpeg(message.jpeg().size()); !status) return status;
  auto picture = decoded<CameraPicture>(kCameraPicture, message, arm);
  if (!picture) return picture;
  if (picture->camera.empty()) return core::Status::invalid_argument("camera is empty; allowed: its name");
  const std::uint64_t pixels = std::uint64_t{picture->width} * picture->height;
  if (pixels > kMaxPicturePixels)
    return core::Status::invalid_argument("width·height is " + std::to_string(pixels) +
                                          "; allowed: at most " + std::to_string(kMaxPicturePixels));
  return picture;
}
core::Expected<SensorPoints> from_idl(const msg::SensorPoints& message, const ArmBounds& arm) {
  auto points = decoded<SensorPoints>(kSensorPoints, message, arm);
  if (!points) return points;
  const std::string why = refusal(*points);
  if (!why.empty()) return core::Status::invalid_argument(why);
  return points;
}
msg::SlaveState to_idl(const SlaveState& state) { return encoded<msg::SlaveState>(kSlaveState, state); }
msg::MasterState to_idl(const MasterState& state) { return encoded<msg::MasterState>(kMasterState, state); }
msg::GripperState to_idl(const GripperState& state) {
  return encoded<msg::GripperState>(kGripperState, state);
}
msg::WristWrench to_idl(const WristWrench& wrench) { return encoded<msg::WristWrench>(kWristWrench, wrench); }
msg::ViewPose to_idl(const ViewPose& view) { return encoded<msg::ViewPose>(kViewPose, view); }
msg::ViewPicture to_idl(const ViewPicture& picture) {
  return encoded<msg::ViewPicture>(kViewPicture, picture);
}
msg::CameraPicture to_idl(const CameraPicture& picture) {
  return encoded<msg::CameraPicture>(kCameraPicture, picture);
}
msg::SensorPoints to_idl(const SensorPoints& points) {
  return encoded<msg::SensorPoints>(kSensorPoints, points);
}
msg::OperatorCommand to_idl(const OperatorCommand& command) {
  return encoded<msg::OperatorCommand>(kOperatorCommand, command);
}
msg::OperatorReply to_idl(const OperatorReply& reply) {
  return encoded<msg::OperatorReply>(kOperatorReply, reply);
}

}  // namespace phantom::messages
