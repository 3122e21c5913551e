#include "components/ros2_gateway/dds_adapter_out.hpp"

#include "common/core/clock.hpp"
#include "common/messages/checked_reader.hpp"
#include "common/messages/percept_codec.hpp"
#include "common/messages/status_codec.hpp"
#include "common/messages/teleoperation_codec.hpp"
#include "common/ros2/endpoint.hpp"
#include "ros2_idl/diagnostic_msgsPubSubTypes.hpp"
#include "ros2_idl/sensor_msgsPubSubTypes.hpp"
#include "ros2_idl/std_msgsPubSubTypes.hpp"
#include "ros2_idl/tf2_msgsPubSubTypes.hpp"
#include "ros2_idl/visualization_msgsPubSubTypes.hpp"

namespace phantom::ros2_gateway {
namespace {

namespace geo = geometry_msgs::msg::dds_;
using JointState = sensor_msgs::msg::dds_::JointState_PubSubType;
using Float64 = std_msgs::msg::dds_::Float64_PubSubType;
using String = std_msgs::msg::dds_::String_PubSubType;
using Transforms = tf2_msgs::msg::dds_::TFMessage_PubSubType;
using Marker = visualization_msgs::msg::dds_::Marker_PubSubType;
using Diagnostics = diagnostic_msgs::msg::dds_::DiagnosticArray_PubSubType;
using Level = std::uint8_t;
constexpr Level kOk = 0, kWarn = 1, kError = 2, kStale = 3;    // diagnostic_msgs/msg/DiagnosticStatus
constexpr std::int32_t kSphere = 2, kAdd = 0, kDelete = 2;     // visualization_msgs/msg/Marker
constexpr double kWorstPlace_m = 0.03;                         // diameter of its marker
constexpr core::Nanoseconds kSilent = 2 * core::kNsPerSecond;  // a component that was not heard for so long

std_msgs::msg::dds_::Header_ header(const std::string& frame) {
  const core::Nanoseconds now_ns = core::utc_ns();
  std_msgs::msg::dds_::Header_ made;
  made.stamp().sec(static_cast<std::int32_t>(now_ns / core::kNsPerSecond));
  made.stamp().nanosec(static_cast<std::uint32_t>(now_ns % core::kNsPerSecond));
  made.frame_id(frame);
  return made;
}

std::vector<double> values(const core::JointArray& joints, std::uint32_t count) {
  return {joints.begin(), joints.begin() + count};
}

geo::TransformStamped_ transform(const std::string& parent, const std::string& child,
                                 const geometry::Pose& X) {
  geo::TransformStamped_ made;
  made.header(header(parent));
  made.child_frame_id(child);
  const Eigen::Vector4d q = geometry::quaternion_xyzw(X.rotation);
  auto& to = made.transform();
  to.translation().x(X.translation_m.x()), to.translation().y(X.translation_m.y());
  to.translation().z(X.translation_m.z());
  to.rotation().x(q[0]), to.rotation().y(q[1]), to.rotation().z(q[2]), to.rotation().w(q[3]);
  return made;
}

Level level_of(core::ComponentState state) {
  using enum core::ComponentState;
  return state == kFault ? kError : state == kDegraded || state == kStopped ? kWarn : kOk;
}

diagnostic_msgs::msg::dds_::DiagnosticStatus_ diagnostic(const std::string& name, Level level,
                                                         const std::string& message) {
  diagnostic_msgs::msg::dds_::DiagnosticStatus_ made;
  made.name("phantom: " + name);
  made.level(level);
  made.message(message);
  return made;
}

void add_value(diagnostic_msgs::msg::dds_::DiagnosticStatus_& to, const std::string& key,
               const std::string& value) {
  diagnostic_msgs::msg::dds_::KeyValue_ pair;
  pair.key(key), pair.value(value);
  to.values().push_back(pair);
}

/// The newest sample of a topic, until it is taken.
template <class Message, class Sample>
class Newest {
 public:
  Newest(dds::Participant& participant, const dds::TopicSpec<Message>& topic, const messages::ArmBounds& arm)
      : reader_(participant, topic, arm, [this](const Sample& sample, core::Nanoseconds) {
          const std::lock_guard lock(mutex_);
          newest_ = sample;
        }) {}
  std::optional<Sample> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(newest_, std::nullopt);
  }

 private:
  std::mutex mutex_;
  std::optional<Sample> newest_;
  messages::CheckedReader<Message> reader_;
};

}  // namespace

struct Outputs::Impl {
  Impl(dds::Participant& phantom, ros2::Node& node, const robot::SerialArm& its_arm,
       const OutputRules& its_rules, const std::string& urdf)
      : arm(its_arm),
        rules(its_rules),
        slave(phantom, dds::kSlaveState, messages::bounds_of(arm)),
        master(phantom, dds::kMasterState, messages::bounds_of(arm)),
        percept(phantom, dds::kPercept, messages::bounds_of(arm)),
        alerts(phantom, dds::kHitAlert, messages::bounds_of(arm)),
        components(phantom, dds::kComponentStatus,
                   [this](const msg::ComponentStatus& status, const dds::SampleInfo& info) {
                     const auto read = messages::from_idl(status);
                     if (!read) return false;
                     const std::lock_guard lock(mutex);
                     if (heard.size() < kMostComponents || heard.contains(read->component))
                       heard[read->component] = {*read, info.received_ns};
                     return true;
                   }),
        slave_joints(node, topic("joint_states"), ros2::kDefault),
        master_joints(node, topic("master/joint_states"), ros2::kDefault),
        drag(node, topic("percept/drag"), ros2::kDefault),
        closeness(node, topic("percept/closeness"), ros2::kDefault),
        speed(node, topic("percept/speed"), ros2::kDefault),
        worst(node, topic("percept/worst_place"), ros2::kDefault),
        transforms(node, "tf", ros2::kTransforms),
        static_transforms(node, "tf_static", ros2::kLatched),
        diagnostics(node, "diagnostics", ros2::kDefault),
        description(node, topic("robot_description"), ros2::kLatched) {
    for (const robot::Joint& joint : arm.joints()) names.push_back(joint.name);
    for (const robot::Link& link : arm.links()) {
      const auto own = arm.find_frame(link.name);
      X_LN.push_back(own ? own->second : geometry::Pose{});
    }
    tf2_msgs::msg::dds_::TFMessage_ fixed;
    fixed.transforms().push_back(transform(rules.world, frame(0), arm.base_pose() * X_LN[0]));
    for (std::size_t link = 0; link < arm.links().size(); ++link)
      for (const auto& [name, X_LF] : arm.links()[link].frames)
        if (name != arm.links()[link].name)
          fixed.transforms().push_back(
              transform(frame(link), rules.frame_prefix + name, X_LN[link].inverse() * X_LF));
    static_transforms.publish(fixed);
    if (urdf.empty()) return;
    std_msgs::msg::dds_::String_ text;
    text.data(urdf);
    description.publish(text);
  }

  std::string topic(const char* name) const { return rules.prefix + "/" + name; }
  std::string frame(std::size_t link) const { return rules.frame_prefix + arm.links()[link].name; }

  template <class State>
  JointState::type joints_of(const State& state, const core::JointArray& effort) const {
    JointState::type joints;
    joints.header(header(frame(0)));
    joints.name(names);
    joints.position(values(state.position, state.joint_count));
    joints.velocity(values(state.velocity, state.joint_count));
    joints.effort(values(effort, state.joint_count));
    return joints;
  }

  void publish_slave(const messages::SlaveState& state) {
    slave_joints.publish(joints_of(state, state.loop_torque_Nm));
    robot::LinkPoses X_WL;
    arm.link_poses(state.position, X_WL);
    tf2_msgs::msg::dds_::TFMessage_ moved;
    for (std::size_t link = 1; link < arm.links().size(); ++link) {
      const geometry::Pose parent = X_WL[link - 1] * X_LN[link - 1];
      moved.transforms().push_back(
          transform(frame(link - 1), frame(link), parent.inverse() * (X_WL[link] * X_LN[link])));
    }
    transforms.publish(moved);
  }

  void publish_master(const messages::MasterState& state) {
    master_joints.publish(joints_of(state, state.percept_torque_Nm));
  }

  void publish_percept(const messages::Percept& felt) {
    std_msgs::msg::dds_::Float64_ number;
    number.data(felt.valid ? felt.closeness : std::numeric_limits<double>::quiet_NaN());
    closeness.publish(number);
    number.data(felt.valid ? felt.speed_m_s : std::numeric_limits<double>::quiet_NaN());
    speed.publish(number);
    sensor_msgs::msg::dds_::JointState_ torques;
    torques.header(header(frame(0)));
    torques.name(names);
    torques.effort(values(felt.drag_torque_Nm, felt.joint_count));
    if (felt.valid) drag.publish(torques);
    visualization_msgs::msg::dds_::Marker_ marker;
    marker.header(header(rules.world));
    marker.ns("phantom");
    marker.type(kSphere);
    marker.action(felt.valid && felt.object != 0 ? kAdd : kDelete);
    marker.pose().position().x(felt.position_m[0]), marker.pose().position().y(felt.position_m[1]);
    marker.pose().position().z(felt.position_m[2]);
    marker.pose().orientation().w(1.0);
    marker.scale().x(kWorstPlace_m), marker.scale().y(kWorstPlace_m), marker.scale().z(kWorstPlace_m);
    // Free is green, the surface red, as the page has it.
    const auto red = static_cast<float>(felt.closeness);
    marker.color().r(red), marker.color().g(1.0F - red), marker.color().a(0.9F);
    worst.publish(marker);
  }

  void publish_diagnostics() {
    diagnostic_msgs::msg::dds_::DiagnosticArray_ list;
    list.header(header(""));
    if (const auto newest = alerts.take()) alert = newest;
    if (alert) {
      const bool stands = !alert->cleared;
      auto status = diagnostic("hit alert", stands ? kWarn : kOk,
                               stands ? alert->link_name + " may hit something" : "no hit threatens");
      add_value(status, "number", std::to_string(alert->alert));
      add_value(status, "speed_m_s", std::to_string(alert->speed_m_s));
      list.status().push_back(status);
    }
    const core::Nanoseconds now_ns = core::monotonic_ns();
    const std::lock_guard lock(mutex);
    for (const auto& [component, last] : heard) {
      const auto& [state, at_ns] = last;
      const bool silent = now_ns - at_ns > kSilent;
      auto status = diagnostic(component, silent ? kStale : level_of(state.state),
                               silent ? "not heard any more"
                                      : std::string(core::name_of(state.state)) +
                                            (state.message.empty() ? "" : ": ") + state.message);
      status.hardware_id(state.host);
      for (const core::HealthFigure& figure : state.figures)
        add_value(status, figure.name,
                  std::to_string(figure.value) + (figure.unit.empty() ? "" : " " + figure.unit));
      list.status().push_back(status);
    }
    diagnostics.publish(list);
  }

  static constexpr std::size_t kMostComponents = 64;

  robot::SerialArm arm;
  OutputRules rules;
  std::vector<std::string> names;
  std::vector<geometry::Pose>
      X_LN;  // the frame that has the link's name, in the link: of a DH table not its own
  std::mutex mutex;
  std::map<std::string, std::pair<messages::ComponentStatus, core::Nanoseconds>> heard;
  std::optional<messages::HitAlert> alert;

  Newest<msg::SlaveState, messages::SlaveState> slave;
  Newest<msg::MasterState, messages::MasterState> master;
  Newest<msg::Percept, messages::Percept> percept;
  Newest<msg::HitAlert, messages::HitAlert> alerts;
  dds::Reader<msg::ComponentStatus> components;

  ros2::Publisher<JointState> slave_joints, master_joints, drag;
  ros2::Publisher<Float64> closeness, speed;
  ros2::Publisher<Marker> worst;
  ros2::Publisher<Transforms> transforms, static_transforms;
  ros2::Publisher<Diagnostics> diagnostics;
  ros2::Publisher<String> description;
};

Outputs::Outputs(dds::Participant& phantom, ros2::Node& node, const robot::SerialArm& arm,
                 const OutputRules& rules, const std::string& urdf)
    : impl_(std::make_unique<Impl>(phantom, node, arm, rules, urdf)) {}
Outputs::~Outputs() = default;

void Outputs::publish(bool diagnostics) {
  if (const auto state = impl_->slave.take()) impl_->publish_slave(*state);
  if (const auto state = impl_->master.take()) impl_->publish_master(*state);
  if (const auto felt = impl_->percept.take()) impl_->publish_percept(*felt);
  if (diagnostics) impl_->publish_diagnostics();
}

}  // namespace phantom::ros2_gateway
