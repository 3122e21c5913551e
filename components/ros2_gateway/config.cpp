#include "components/ros2_gateway/config.hpp"

#include <algorithm>

#include "common/runtime/fields.hpp"

namespace phantom::ros2_gateway {

GatewayConfig load_config(const std::filesystem::path& path) {
  const runtime::Fields file(path, {kParameters});
  GatewayConfig config;
  config.file = path;
  file.text("arm", config.arm);
  file.number("domain", config.node.domain);
  file.texts("interfaces", config.node.interfaces);
  file.texts("initial_peers", config.node.initial_peers);
  file.text("node", config.node.name);
  using enum ros2::Graph;
  file.choice("graph", config.node.graph, {{"none", kNone}, {"humble", kHumble}, {"iron", kSinceIron}});
  const auto joints = file.section("joint_states");
  joints.text("topic", config.joint_states_topic);
  joints.texts("names", config.joint_names);
  joints.number("staleness_s", config.joint_states.staleness_s);
  joints.number("largest_stamp_age_s", config.joint_states.largest_stamp_age_s);
  joints.number("velocity_filter_s", config.joint_states.velocity_filter_s);
  const auto wrench = file.section("wrench");
  wrench.text("topic", config.wrench_topic);
  wrench.text("frame", config.wrench_frame);
  file.section("collision_objects").text("topic", config.collision_objects_topic);
  const auto out = file.section("out");
  out.number("rate_Hz", config.out.rate_Hz);
  out.text("prefix", config.out.prefix);
  out.text("frame_prefix", config.out.frame_prefix);
  out.text("world", config.out.world);
  file.finish();
  return config;
}

std::vector<std::string> message_names(const GatewayConfig& config, const robot::SerialArm& arm) {
  std::vector<std::string> own;
  for (const robot::Joint& joint : arm.joints()) own.push_back(joint.name);
  const std::vector<std::string>& given = config.joint_names;
  if (given.empty()) return own;
  if (given.size() != own.size())
    throw core::ConfigError(config.file.string() + ": joint_states.names: has " +
                            std::to_string(given.size()) + " names; allowed: " + std::to_string(own.size()) +
                            ", one for each joint of the arm, or none");
  for (const std::string& name : given) {
    if (std::count(given.begin(), given.end(), name) > 1)
      throw core::ConfigError(config.file.string() + ": joint_states.names: has '" + name +
                              "' twice; allowed: each once");
  }
  return given;
}

}  // namespace phantom::ros2_gateway
