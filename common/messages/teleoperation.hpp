#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/core/clock.hpp"
#include "common/core/joints.hpp"
#include "common/core/sample_id.hpp"
#include "common/geometry/pose.hpp"
#include "common/messages/received.hpp"
#include "common/teleop/commands/operator_command.hpp"
#include "common/teleop/coupling/bilateral.hpp"
#include "common/teleop/coupling/counterbalance.hpp"
#include "common/teleop/coupling/link_state.hpp"
#include "common/teleop/coupling/stop_latch.hpp"
#include "common/teleop/gripper/gripper.hpp"
#include "phantom_contract/teleoperation_samples.hpp"

// The samples of the topics of idl/teleoperation.idl as components use them. Units and frames are in the IDL
// where a name does not say them. States are trivially copyable, as core::Snapshot requires.

namespace phantom::messages {

/// Topic slave_state: the arm as its encoders and drives report it.
struct SlaveState {
  core::SampleId stamp;
  core::SampleId master_echo;  ///< the master_state that the drives follow now
  teleop::LinkState state = teleop::LinkState::kInit;
  teleop::StopRecord stop;       ///< the stop in force
  bool switch_fitted = false;    ///< this side has an enabling switch
  bool motion_permitted = true;  ///< and it is held; true without one
  std::uint32_t joint_count = 0;
  core::JointArray position{};        ///< rad or m
  core::JointArray velocity{};        ///< rad/s or m/s
  core::JointArray loop_torque_Nm{};  ///< of the position loop (F_as)
  teleop::Counterbalance counterbalance = teleop::Counterbalance::kMechanical;
  bool force_measured = false;  ///< external_torque_Nm is known
  core::JointArray external_torque_Nm{};
  bool contact = false;
  double contact_force_N = -1.0;     ///< −1: not measured
  std::uint16_t contact_object = 0;  ///< 0: none or unknown
  Vector3 contact_point_m{};         ///< in W; known while contact_force_N is
  double tool_speed_m_s = 0.0;
  double clearance_m = -1.0;  ///< −1: unknown

  friend bool operator==(const SlaveState&, const SlaveState&) = default;
};

/// Topic master_state: the state of the operator's side.
struct MasterState {
  core::SampleId stamp;
  teleop::LinkState state = teleop::LinkState::kInit;
  teleop::StopRecord stop;       ///< the stop in force
  bool switch_fitted = false;    ///< this side has an enabling switch
  bool motion_permitted = true;  ///< and it is held; true without one
  teleop::BilateralLaw law = teleop::BilateralLaw::kPf;
  std::uint32_t joint_count = 0;
  core::JointArray position{};  ///< in the slave's joint coordinates
  core::JointArray velocity{};
  core::JointArray percept_torque_Nm{};                   ///< drag rendered, scaled by G and limited
  core::JointArray feedback_torque_Nm{};                  ///< slave feedback rendered, divided by A
  core::JointArray operator_torque_Nm{};                  ///< torque of the operator's hand; 0 if unknown
  double percept_gain = 0.0;                              ///< G in force
  double feedback_gain = 0.0;                             ///< 1/A in force
  bool percept_enabled = false, percept_limited = false;  ///< of drag
  bool drag_chosen = true;  ///< by the operator; a script of reaches may go without it meanwhile
  bool tone_enabled = true, views_enabled = true;
  bool percept_set_automatic = false;  ///< drag, tone and views are as Table 6.1 has them beside the law
  bool feedback_limited = false, feedback_damped = false;
  bool force_missing = false;  ///< the law needs F_e, which the slave does not measure
  /// Running number of the operator's reach, which rises during a session; −1: none.
  std::int32_t reach = -1;
  core::SampleId slave_echo, drag_echo;
  double round_trip_s = -1.0;  ///< −1: no new measurement

  friend bool operator==(const MasterState&, const MasterState&) = default;
};

/// Topic gripper_state: the gripper as its drive reports it, and what it can do.
struct GripperState : teleop::GripperStatus {
  core::SampleId stamp;
  double widest_m = 0.0, least_force_N = 0.0, greatest_force_N = 0.0;
};

/// Topic sensor_points: what a sensor measures of its surroundings, in its own frame.
struct SensorPoints {
  core::SampleId stamp;
  core::Nanoseconds measured_utc_ns = 0;  ///< by its host's clock; 0: not said
  std::string frame;
  std::uint32_t width = 0, height = 0;  ///< height 1: without order
  std::vector<float> xyz_m;             ///< row by row; NaN, all three: nothing was measured

  friend bool operator==(const SensorPoints&, const SensorPoints&) = default;
};
/// Greatest number of points of a sample.
inline constexpr std::uint64_t kMaxSensorPoints = 1'000'000;
/// Longest name of a sensor's frame.
inline constexpr std::size_t kMaxFrame = 255;

/// Topic operator_command: a command from a person or a script to the running system.
struct OperatorCommand {
  core::SampleId stamp;  ///< identifies the command, also when it is sent again
  teleop::CommandKind kind = teleop::CommandKind::kEmergencyStop;
  double value = 0.0;       ///< within the kind's range (teleop::value_refusal)
  std::int32_t joint = -1;  ///< set gain: the only joint that it applies to, from 0; −1: all
  teleop::StopId master_stop = 0, slave_stop = 0;  ///< reset: the stops to end; 0: none
  std::string issuer;                              ///< for the log
};

/// Topic operator_reply: one side's answer to a command.
struct OperatorReply {
  core::SampleId stamp;
  core::SampleId command;  ///< the command's stamp
  std::string component;   ///< master_io or slave_io
  teleop::CommandKind kind = teleop::CommandKind::kEmergencyStop;
  bool done = false;    ///< false: refused; nothing was changed
  std::string message;  ///< what was done, or why not and what is allowed

  friend bool operator==(const OperatorReply&, const OperatorReply&) = default;
};

/// Topic view_pose: the pose of the view that the operator looks at.
struct ViewPose {
  core::SampleId stamp;
  bool hit_zone = false;   ///< true: the view of the zone that threatens to be hit; false: the main view
  int node = 0;            ///< look-from node (percept::ViewNode); 0: none
  bool automatic = false;  ///< the viewer chose the node
  geometry::Pose X_WC;     ///< camera: x right, y up, z backward
  Vector3 look_at_m{};     ///< in W
};

/// Greatest size of a picture.
inline constexpr std::size_t kMaxPictureBytes = std::size_t{4} << 20;

/// Topic camera_picture: a camera's newest picture as it was taken.
struct CameraPicture {
  core::SampleId stamp;
  std::string camera;                    ///< its name
  core::Nanoseconds exposed_utc_ns = 0;  ///< by its host's clock; 0: not said
  std::uint32_t width = 0, height = 0;   ///< px
  std::vector<std::uint8_t> jpeg;

  friend bool operator==(const CameraPicture&, const CameraPicture&) = default;
};
/// Least and greatest size of a camera's pictures.
inline constexpr std::uint32_t kMinPictureSide_px = 16, kMaxPictureSide_px = 8192;
inline constexpr std::uint64_t kMaxPicturePixels = std::uint64_t{1} << 24;

}  // namespace phantom::messages
