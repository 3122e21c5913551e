#include "common/ros2/from_phantom.hpp"

#include <limits>

#include "common/robot/kinematics/tool_wrench.hpp"
#include "common/ros2/words.hpp"

namespace phantom::ros2 {
namespace {

using Level = std::uint8_t;
constexpr Level kOk = 0, kWarn = 1, kError = 2, kStale = 3;  // diagnostic_msgs/msg/DiagnosticStatus
constexpr std::int32_t kSphere = 2, kAdd = 0, kDelete = 2;   // visualization_msgs/msg/Marker
constexpr double kWorstPlace_m = 0.03;                       // diameter of its marker
constexpr const char* kToolFrame = "at_tool";                // where wrenches act, with the frames' prefix

std::vector<double> values(const core::JointArray& joints, std::uint32_t count) {
  return {joints.begin(), joints.begin() + count};
}

geometry_msgs::msg::dds_::TransformStamped_ transform(const std::string& parent, const std::string& child,
                                                      const geometry::Pose& X, core::Nanoseconds utc_ns) {
  geometry_msgs::msg::dds_::TransformStamped_ made;
  made.header(header(parent, utc_ns));
  made.child_frame_id(child);
  const Eigen::Vector4d q = geometry::quaternion_xyzw(X.rotation);
  auto& to = made.transform();
  to.translation().x(X.translation_m.x()), to.translation().y(X.translation_m.y());
  to.translation().z(X.translation_m.z());
  to.rotation().x(q[0]), to.rotation().y(q[1]), to.rotation().z(q[2]), to.rotation().w(q[3]);
  return made;
}

std_msgs::msg::dds_::Float64_ number_of(bool valid, double value) {
  std_msgs::msg::dds_::Float64_ number;
  number.data(valid ? value : std::numeric_limits<double>::quiet_NaN());
  return number;
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

diagnostic_msgs::msg::dds_::DiagnosticStatus_ diagnostic_of(const std::string& component,
                                                            const messages::ComponentStatus& state,
                                                            bool silent) {
  auto status = diagnostic(
      component, silent ? kStale : level_of(state.state),
      silent ? "lost"
             : std::string(core::name_of(state.state)) + (state.message.empty() ? "" : ": ") + state.message);
  status.hardware_id(state.host);
  for (const core::HealthFigure& figure : state.figures)
    add_value(status, figure.name,
              std::to_string(figure.value) + (figure.unit.empty() ? "" : " " + figure.unit));
  return status;
}

}  // namespace

FromPhantomTopics::FromPhantomTopics(const std::string& prefix)
    : slave{prefix + "/joint_states", kDefault},
      master{prefix + "/master/joint_states", kDefault},
      drag{prefix + "/percept/drag", kDefault},
      drag_wrench{prefix + "/percept/drag_wrench", kDefault},
      torque_wrench{prefix + "/percept/torque_wrench", kDefault},
      closeness{prefix + "/percept/closeness", kDefault},
      speed{prefix + "/percept/speed", kDefault},
      worst_place{prefix + "/percept/worst_place", kDefault},
      transforms{"tf", kTransforms},
      fixed_transforms{"tf_static", kLatched},
      diagnostics{"diagnostics", kDefault},
      description{prefix + "/robot_description", kLatched} {}

FromPhantom::FromPhantom(const robot::SerialArm& arm, Names names) : arm_(arm), names_(std::move(names)) {
  for (const robot::Joint& joint : arm_.joints()) joint_names_.push_back(joint.name);
  for (const robot::Link& link : arm_.links()) {
    const auto own = arm_.find_frame(link.name);
    X_LN_.push_back(own ? own->second : geometry::Pose{});
  }
}

template <class State>
sensor_msgs::msg::dds_::JointState_ FromPhantom::joints_of(const State& state, const core::JointArray& effort,
                                                           core::Nanoseconds utc_ns) const {
  sensor_msgs::msg::dds_::JointState_ joints;
  joints.header(header(frame(0), utc_ns));
  joints.name(joint_names_);
  joints.position(values(state.position, state.joint_count));
  joints.velocity(values(state.velocity, state.joint_count));
  joints.effort(values(effort, state.joint_count));
  return joints;
}

sensor_msgs::msg::dds_::JointState_ FromPhantom::joints(const messages::SlaveState& state,
                                                        core::Nanoseconds utc_ns) const {
  return joints_of(state, state.loop_torque_Nm, utc_ns);
}

sensor_msgs::msg::dds_::JointState_ FromPhantom::joints(const messages::MasterState& state,
                                                        core::Nanoseconds utc_ns) const {
  return joints_of(state, state.percept_torque_Nm, utc_ns);
}

sensor_msgs::msg::dds_::JointState_ FromPhantom::drag(const messages::Percept& felt,
                                                      core::Nanoseconds utc_ns) const {
  sensor_msgs::msg::dds_::JointState_ torques;
  torques.header(header(frame(0), utc_ns));
  torques.name(joint_names_);
  torques.effort(values(felt.drag_torque_Nm, felt.joint_count));
  return torques;
}

geometry_msgs::msg::dds_::WrenchStamped_ FromPhantom::wrench(const core::JointArray& position,
                                                             const core::JointArray& torque,
                                                             core::Nanoseconds utc_ns) const {
  const robot::Spatial at_tool = robot::wrench_at_tool(arm_, position, torque);
  geometry_msgs::msg::dds_::WrenchStamped_ made;
  made.header(header(names_.frame_prefix + kToolFrame, utc_ns));
  auto& f_N = made.wrench().force();
  auto& m_Nm = made.wrench().torque();
  f_N.x(at_tool[0]), f_N.y(at_tool[1]), f_N.z(at_tool[2]);
  m_Nm.x(at_tool[3]), m_Nm.y(at_tool[4]), m_Nm.z(at_tool[5]);
  return made;
}

std_msgs::msg::dds_::Float64_ FromPhantom::closeness(const messages::Percept& felt) const {
  return number_of(felt.valid, felt.closeness);
}

std_msgs::msg::dds_::Float64_ FromPhantom::speed(const messages::Percept& felt) const {
  return number_of(felt.valid, felt.speed_m_s);
}

visualization_msgs::msg::dds_::Marker_ FromPhantom::worst_place(const messages::Percept& felt,
                                                                core::Nanoseconds utc_ns) const {
  visualization_msgs::msg::dds_::Marker_ marker;
  marker.header(header(names_.world, utc_ns));
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
  return marker;
}

tf2_msgs::msg::dds_::TFMessage_ FromPhantom::transforms(const messages::SlaveState& state,
                                                        core::Nanoseconds utc_ns) const {
  robot::LinkPoses X_WL;
  arm_.link_poses(state.position, X_WL);
  tf2_msgs::msg::dds_::TFMessage_ moved;
  for (std::size_t link = 1; link < arm_.links().size(); ++link) {
    const geometry::Pose parent = X_WL[link - 1] * X_LN_[link - 1];
    moved.transforms().push_back(
        transform(frame(link - 1), frame(link), parent.inverse() * (X_WL[link] * X_LN_[link]), utc_ns));
  }
  return moved;
}

tf2_msgs::msg::dds_::TFMessage_ FromPhantom::fixed_transforms(core::Nanoseconds utc_ns) const {
  tf2_msgs::msg::dds_::TFMessage_ fixed;
  fixed.transforms().push_back(transform(names_.world, frame(0), arm_.base_pose() * X_LN_[0], utc_ns));
  for (std::size_t link = 0; link < arm_.links().size(); ++link)
    for (const auto& [name, X_LF] : arm_.links()[link].frames)
      if (name != arm_.links()[link].name)
        fixed.transforms().push_back(
            transform(frame(link), names_.frame_prefix + name, X_LN_[link].inverse() * X_LF, utc_ns));
  robot::LinkPoses X_WL;
  arm_.link_poses({}, X_WL);
  const std::size_t last = arm_.links().size() - 1;
  fixed.transforms().push_back(transform(frame(last), names_.frame_prefix + kToolFrame,
                                         (X_WL[last] * X_LN_[last]).inverse() * robot::tool_pose(arm_, X_WL),
                                         utc_ns));
  return fixed;
}

void Diagnostics::hear(const messages::ComponentStatus& status, core::Nanoseconds at_ns) {
  if (heard_.size() < kMaxComponents || heard_.contains(status.component))
    heard_[status.component] = {status, at_ns};
}

diagnostic_msgs::msg::dds_::DiagnosticArray_ Diagnostics::message(core::Nanoseconds now_ns,
                                                                  core::Nanoseconds utc_ns) const {
  diagnostic_msgs::msg::dds_::DiagnosticArray_ list;
  list.header(header("", utc_ns));
  if (alert_) {
    const bool stands = !alert_->cleared;
    auto status = diagnostic("hit alert", stands ? kWarn : kOk,
                             stands ? alert_->link_name + " may hit something" : "no hit threatens");
    add_value(status, "number", std::to_string(alert_->alert));
    add_value(status, "speed_m_s", std::to_string(alert_->speed_m_s));
    list.status().push_back(status);
  }
  for (const auto& [component, last] : heard_)
    list.status().push_back(diagnostic_of(component, last.first, now_ns - last.second > kSilent));
  return list;
}

std_msgs::msg::dds_::String_ text_message(const std::string& text) {
  std_msgs::msg::dds_::String_ made;
  made.data(text);
  return made;
}

}  // namespace phantom::ros2
