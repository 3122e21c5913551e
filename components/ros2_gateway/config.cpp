#include "components/ros2_gateway/config.hpp"

#include <algorithm>
#include <set>

#include "common/messages/living.hpp"
#include "common/runtime/configuration/fields.hpp"

namespace phantom::ros2_gateway {

namespace {

void read_master(const runtime::Fields& from, MasterRules& master) {
  from.text("twist_topic", master.twist_topic);
  from.text("joy_topic", master.joy_topic);
  from.check(master.twist_topic.empty() || master.joy_topic.empty(), "joy_topic",
             "twist_topic is given, too; allowed: one of them");
  from.text("frame", master.frame);
  TwistMasterRules& handle = master.handle;
  from.number("staleness_s", handle.staleness_s);
  from.number("largest_stamp_age_s", handle.largest_stamp_age_s);
  from.number("largest_speed_m_s", handle.largest_speed_m_s);
  from.number("largest_turn_rad_s", handle.largest_turn_rad_s);
  from.number("mass_kg", handle.mass_kg);
  from.number("inertia_kg_m2", handle.inertia_kg_m2);
  from.number("push_N_s_per_m", handle.push_N_s_per_m);
  from.number("push_N_m_s_per_rad", handle.push_N_m_s_per_rad);
  std::vector<int> axes(handle.joy_axes.begin(), handle.joy_axes.end());
  from.numbers("joy_axes", axes);
  from.check(axes.size() == handle.joy_axes.size(), "joy_axes",
             "has " + std::to_string(axes.size()) + " axes; allowed: 6, -1 for none");
  std::copy(axes.begin(), axes.end(), handle.joy_axes.begin());
  from.number("joy_enable_button", handle.joy_enable);
}

void read_points(const runtime::Fields& from, CloudTopics& points) {
  from.text("cloud_topic", points.cloud);
  from.text("depth_topic", points.depth);
  from.text("camera_info_topic", points.camera_info);
  from.check(points.depth.empty() == points.camera_info.empty(), "camera_info_topic",
             "depth images need their camera's topic, and it is of no use without them");
  from.check(points.depth.empty() || points.cloud.empty(), "depth_topic",
             "cloud_topic is given, too; allowed: one of them");
  from.number("largest_stamp_age_s", points.largest_stamp_age_s);
}

DepthCameraRules read_depth_camera(const runtime::Fields& from) {
  DepthCameraRules camera;
  from.text("name", camera.name);
  from.text("image_topic", camera.topics.depth);
  from.text("cloud_topic", camera.topics.cloud);
  from.text("camera_info_topic", camera.topics.camera_info);
  from.check(camera.topics.depth.empty() != camera.topics.cloud.empty(), "image_topic",
             "is given beside cloud_topic, or neither is; allowed: one of them");
  from.number("min_depth_m", camera.range.min_m);
  from.number("max_depth_m", camera.range.max_m);
  from.check(camera.range.max_m > camera.range.min_m, "max_depth_m",
             "is not above min_depth_m; allowed: more than that");
  from.number("largest_stamp_age_s", camera.topics.largest_stamp_age_s);
  from.number("latency_s", camera.latency_s);
  return camera;
}

void read_camera(const runtime::Fields& from, CameraRules& camera) {
  from.text("image_topic", camera.image_topic);
  from.text("compressed_topic", camera.compressed_topic);
  from.check(camera.image_topic.empty() || camera.compressed_topic.empty(), "compressed_topic",
             "image_topic is given, too; allowed: one of them");
  from.text("name", camera.name);
  from.number("rate_Hz", camera.rate_Hz);
  from.number("jpeg_quality", camera.jpeg_quality);
  from.number("largest_stamp_age_s", camera.largest_stamp_age_s);
}

void read_workspace(const runtime::Fields& out, WorkspaceRules& workspace) {
  out.flag("meshes", workspace.meshes);
  std::vector<int> orders;
  out.numbers("clouds", orders);
  for (const int order : orders) {
    out.check(
        order >= -98 && order <= 100 && order != 0, "clouds",
        std::to_string(order) + "; allowed: 100 (boundary), 99 (guard), 1 to 98 and -98 to -1 (layers)");
    out.check(std::count(orders.begin(), orders.end(), order) == 1, "clouds",
              std::to_string(order) + " is there twice; allowed: each once");
    workspace.clouds.push_back(static_cast<std::int8_t>(order));
  }
}

}  // namespace

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
  read_master(file.section("master"), config.master);
  read_points(file.section("points"), config.points);
  read_camera(file.section("camera"), config.camera);
  std::set<std::string> names;
  for (const runtime::Fields& fields : file.sections("depth_cameras")) {
    config.depth_cameras.push_back(read_depth_camera(fields));
    fields.check(names.insert(config.depth_cameras.back().name).second, "name",
                 "is another camera's, too; allowed: each once");
  }
  file.check(config.depth_cameras.size() <= messages::kMaxDepthCameras, "depth_cameras",
             "has too many; allowed: 0 to 16");
  const auto out = file.section("out");
  out.number("rate_Hz", config.out.rate_Hz);
  out.text("prefix", config.out.prefix);
  out.text("frame_prefix", config.out.frame_prefix);
  out.text("world", config.out.world);
  out.flag("views", config.out.views);
  read_workspace(out, config.workspace);
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
