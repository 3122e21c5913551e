#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/core/clock.hpp"
#include "common/messages/percept.hpp"
#include "common/messages/status.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/ros2/endpoint.hpp"
#include "ros2_idl/diagnostic_msgsPubSubTypes.hpp"
#include "ros2_idl/geometry_msgsPubSubTypes.hpp"
#include "ros2_idl/sensor_msgsPubSubTypes.hpp"
#include "ros2_idl/std_msgsPubSubTypes.hpp"
#include "ros2_idl/tf2_msgsPubSubTypes.hpp"
#include "ros2_idl/visualization_msgsPubSubTypes.hpp"

// What Phantom says in ROS 2's words: topics and messages, for a live domain and for a recording alike. It
// knows no clock: `utc_ns` becomes the message's stamp. Right-handed frames, z up, SI units (REP 103).

namespace phantom::ros2 {

/// Names in ROS 2 of what is Phantom's.
struct Names {
  std::string prefix = "phantom";         ///< of the topics: "phantom/joint_states"
  std::string frame_prefix = "phantom/";  ///< of the links' frames
  std::string world = "world";            ///< frame of the workspace
};

/// The topics, by what they are of.
struct FromPhantomTopics {
  explicit FromPhantomTopics(const std::string& prefix);

  using JointState = sensor_msgs::msg::dds_::JointState_PubSubType;
  using Float64 = std_msgs::msg::dds_::Float64_PubSubType;
  using TfMessage = tf2_msgs::msg::dds_::TFMessage_PubSubType;
  TopicName<JointState> slave, master, drag;
  TopicName<geometry_msgs::msg::dds_::WrenchStamped_PubSubType> drag_wrench, torque_wrench;
  TopicName<Float64> closeness, speed;
  TopicName<visualization_msgs::msg::dds_::Marker_PubSubType> worst_place;
  TopicName<TfMessage> transforms, fixed_transforms;
  TopicName<diagnostic_msgs::msg::dds_::DiagnosticArray_PubSubType> diagnostics;
  TopicName<std_msgs::msg::dds_::String_PubSubType> description;
};

/// Makes messages of ROS 2 of the samples of one arm. Thread-safe.
class FromPhantom {
 public:
  FromPhantom(const robot::SerialArm& arm, Names names);

  /// Position, velocity and the position loop's torques as efforts.
  sensor_msgs::msg::dds_::JointState_ joints(const messages::SlaveState& state,
                                             core::Nanoseconds utc_ns) const;
  /// What the master asks of the arm, with the torques of the percept as efforts.
  sensor_msgs::msg::dds_::JointState_ joints(const messages::MasterState& state,
                                             core::Nanoseconds utc_ns) const;
  /// Torques of the drag as efforts; of a valid percept.
  sensor_msgs::msg::dds_::JointState_ drag(const messages::Percept& felt, core::Nanoseconds utc_ns) const;
  /// The wrench at the tool, in its axes, that makes these torques best (robot::wrench_at_tool); in a frame
  /// of its own.
  geometry_msgs::msg::dds_::WrenchStamped_ wrench(const core::JointArray& position,
                                                  const core::JointArray& torque,
                                                  core::Nanoseconds utc_ns) const;
  /// NaN while the percept is not valid.
  std_msgs::msg::dds_::Float64_ closeness(const messages::Percept& felt) const;
  std_msgs::msg::dds_::Float64_ speed(const messages::Percept& felt) const;
  /// A sphere where the percept is, from green (free) to red (touching); deleted in free space.
  visualization_msgs::msg::dds_::Marker_ worst_place(const messages::Percept& felt,
                                                     core::Nanoseconds utc_ns) const;
  /// Each moved link in its parent; frames that do not move: the base in the world, the others of the arm's
  /// description, and that of wrenches at the tool.
  tf2_msgs::msg::dds_::TFMessage_ transforms(const messages::SlaveState& state,
                                             core::Nanoseconds utc_ns) const;
  tf2_msgs::msg::dds_::TFMessage_ fixed_transforms(core::Nanoseconds utc_ns) const;

 private:
  std::string frame(std::size_t link) const { return names_.frame_prefix + arm_.links()[link].name; }
  template <class State>
  sensor_msgs::msg::dds_::JointState_ joints_of(const State& state, const core::JointArray& effort,
                                                core::Nanoseconds utc_ns) const;

  robot::SerialArm arm_;
  Names names_;
  std::vector<std::string> joint_names_;
  // The frame that has the link's name, in the link: of a DH table not its own.
  std::vector<geometry::Pose> X_LN_;
};

/// Keeps what the components said of themselves, and the last alert, and says them as diagnostics. Of names
/// beyond kMaxComponents nothing is kept. Not thread-safe.
class Diagnostics {
 public:
  static constexpr std::size_t kMaxComponents = 64;
  /// Who was not heard for so long is reported as stale.
  static constexpr core::Nanoseconds kSilent = 2 * core::kNsPerSecond;

  /// `at_ns`: when it came, on the clock of message()'s `now_ns`.
  void hear(const messages::ComponentStatus& status, core::Nanoseconds at_ns);
  void hear(const messages::HitAlert& alert) { alert_ = alert; }
  diagnostic_msgs::msg::dds_::DiagnosticArray_ message(core::Nanoseconds now_ns,
                                                       core::Nanoseconds utc_ns) const;

 private:
  std::map<std::string, std::pair<messages::ComponentStatus, core::Nanoseconds>> heard_;
  std::optional<messages::HitAlert> alert_;
};

/// The arm's description as a message.
std_msgs::msg::dds_::String_ text_message(const std::string& text);

}  // namespace phantom::ros2
