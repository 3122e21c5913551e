#include "components/ros2_gateway/joint_states.hpp"

#include <cmath>

#include "common/core/text.hpp"
#include "common/robot/kinematics/joint_values.hpp"

namespace phantom::ros2_gateway {
namespace {

core::Status refused(const std::string& what) {
  return core::Status::invalid_argument("joint_states: " + what);
}

std::string count_of(std::size_t count, const char* what) { return std::to_string(count) + " " + what; }

std::string in_seconds(core::Nanoseconds duration_ns) {
  return core::formatted("%.3g s", core::seconds(duration_ns));
}

}  // namespace

JointStates::JointStates(const robot::SerialArm& arm, std::vector<std::string> names,
                         const JointStatesRules& rules)
    : arm_(arm), rules_(rules), names_(std::move(names)), heard_(names_.size()) {
  for (std::size_t j = 0; j < names_.size(); ++j) joint_of_.emplace(names_[j], j);
}

core::Status JointStates::check(const JointStateMessage& message, core::Nanoseconds now_ns,
                                core::Nanoseconds utc_now_ns) const {
  if (message.position.size() != message.name.size())
    return refused(count_of(message.name.size(), "names with ") +
                   count_of(message.position.size(), "positions"));
  if (!message.velocity.empty() && message.velocity.size() != message.name.size())
    return refused(count_of(message.name.size(), "names with ") +
                   count_of(message.velocity.size(), "velocities; allowed: as many, or none"));
  for (std::size_t i = 0; i < message.name.size(); ++i) {
    const auto found = joint_of_.find(message.name[i]);
    if (found == joint_of_.end()) continue;
    const robot::Joint& joint = arm_.joints()[found->second];
    if (!robot::near_limits(message.position[i], joint.lower, joint.upper))
      return refused("position of " + message.name[i] + " is " + std::to_string(message.position[i]) +
                     ", outside of the joint's range " + std::to_string(joint.lower) + " to " +
                     std::to_string(joint.upper));
    const Heard& heard = heard_[found->second];
    if (fresh(heard, now_ns) && heard.publisher != message.publisher)
      return refused("another publisher sends " + message.name[i] + ", too; allowed: one for each joint");
    if (!message.velocity.empty() && !std::isfinite(message.velocity[i]))
      return refused("velocity of " + message.name[i] + " is no number");
  }
  const core::Nanoseconds age_ns = utc_now_ns - message.stamp_ns;
  if (message.stamp_ns != 0 && rules_.largest_stamp_age_s > 0.0 &&
      std::abs(core::seconds(age_ns)) > rules_.largest_stamp_age_s)
    return refused("the stamp is " + in_seconds(std::abs(age_ns)) + (age_ns > 0 ? " old" : " in the future") +
                   " by this host's clock; set the clocks, or largest_stamp_age_s to 0");
  return core::Status::ok();
}

bool JointStates::in_order(const JointStateMessage& message) {
  if (message.stamp_ns == 0) return true;
  bool newer = true;
  for (const std::string& name : message.name) {
    const auto found = joint_of_.find(name);
    if (found != joint_of_.end()) newer = newer && message.stamp_ns > heard_[found->second].stamp_ns;
  }
  run_ = newer ? 0 : message.stamp_ns > refused_stamp_ns_ ? run_ + 1 : 1;
  refused_stamp_ns_ = newer ? 0 : message.stamp_ns;
  if (run_ < kRun) return newer;
  for (Heard& heard : heard_) heard = {};  // the sender's clock was set: nothing is differentiated across it
  run_ = 0;
  return true;
}

void JointStates::take(std::size_t joint, double position, const double* velocity,
                       const JointStateMessage& message, core::Nanoseconds now_ns) {
  const core::Nanoseconds stamp_ns = message.stamp_ns;
  Heard& heard = heard_[joint];
  const bool by_stamp = stamp_ns != 0 && heard.stamp_ns != 0;
  const double dt_s = core::seconds(by_stamp ? stamp_ns - heard.stamp_ns : now_ns - heard.at_ns);
  if (velocity != nullptr) {
    heard.velocity = *velocity;
  } else if (heard.at_ns == 0 || !fresh(heard, now_ns) || dt_s <= 0.0) {
    heard.velocity = 0.0;  // nothing is known of how it moved
  } else {
    const double newest = (position - heard.position) / dt_s;
    heard.velocity += (newest - heard.velocity) * dt_s / (dt_s + rules_.velocity_filter_s);
  }
  heard.position = position;
  heard.stamp_ns = stamp_ns;
  heard.publisher = message.publisher;
  heard.at_ns = now_ns;
}

bool JointStates::fresh(const Heard& heard, core::Nanoseconds now_ns) const {
  return heard.at_ns != 0 && core::seconds(now_ns - heard.at_ns) <= rules_.staleness_s;
}

core::Expected<bool> JointStates::accept(const JointStateMessage& message, core::Nanoseconds now_ns,
                                         core::Nanoseconds utc_now_ns, messages::SlaveState& state) {
  if (const core::Status status = check(message, now_ns, utc_now_ns); !status) return status;
  if (!in_order(message)) return refused("the stamp is not newer than the last");
  bool any = false;
  for (std::size_t i = 0; i < message.name.size(); ++i) {
    const auto found = joint_of_.find(message.name[i]);
    if (found == joint_of_.end()) continue;
    any = true;
    take(found->second, message.position[i], message.velocity.empty() ? nullptr : &message.velocity[i],
         message, now_ns);
  }
  for (const Heard& heard : heard_) any = any && fresh(heard, now_ns);
  if (!any) return false;
  state = {};
  state.state = teleop::LinkState::kReady;
  state.joint_count = static_cast<std::uint32_t>(heard_.size());
  for (std::size_t j = 0; j < heard_.size(); ++j) {
    state.position[j] = heard_[j].position;
    state.velocity[j] = heard_[j].velocity;
  }
  robot::LinkPoses X_WL;
  arm_.link_poses(state.position, X_WL);
  const std::size_t last = arm_.joint_count();
  state.tool_speed_m_s =
      arm_.point_velocity_W(last, X_WL[last] * arm_.link_axis_m(last).second, X_WL, state.velocity).norm();
  return true;
}

std::string JointStates::missing(core::Nanoseconds now_ns) const {
  std::string list;
  for (std::size_t j = 0; j < heard_.size(); ++j)
    if (!fresh(heard_[j], now_ns)) core::add_to_list(list, names_[j]);
  return list;
}

}  // namespace phantom::ros2_gateway
