#include "components/ros2_gateway/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "common/core/errors.hpp"

namespace phantom::ros2_gateway::config_test {
namespace {

using testing::HasSubstr;

GatewayConfig load(const std::string& yaml) {
  const auto file =
      std::filesystem::temp_directory_path() / ("ros2_gateway_" + std::to_string(getpid()) + ".yaml");
  std::ofstream(file) << yaml;
  const GatewayConfig config = load_config(file);
  std::filesystem::remove(file);
  return config;
}
std::string refusal(const std::string& yaml) {
  try {
    load(yaml);
  } catch (const core::ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(GatewayConfig, IsAsShippedOrAsTheFileSays) {
  const GatewayConfig shipped = load("domain: 3\n");
  EXPECT_TRUE(shipped.workspace.meshes);
  EXPECT_TRUE(shipped.workspace.clouds.empty());
  EXPECT_FALSE(shipped.out.views);
  EXPECT_EQ(shipped.master.twist_topic + shipped.master.joy_topic + shipped.points.cloud, "");
  EXPECT_EQ(shipped.master.handle.joy_axes, TwistMasterRules().joy_axes);
  EXPECT_EQ(shipped.master.handle.push_N_s_per_m, TwistMasterRules().push_N_s_per_m);
  EXPECT_EQ(shipped.master.handle.largest_speed_m_s, TwistMasterRules().largest_speed_m_s);
  const GatewayConfig own = load(
      "out: {clouds: [100, 99, 3, -2], views: true, meshes: false}\n"
      "master: {joy_topic: joy, joy_axes: [0, 1, 2, 3, 4, 5], joy_enable_button: 7}\n"
      "points: {depth_topic: d, camera_info_topic: c}\n"
      "camera: {compressed_topic: i, name: gate, rate_Hz: 5}\n"
      "depth_cameras:\n"
      "  - {name: above, image_topic: a/depth, camera_info_topic: a/info, max_depth_m: 3}\n"
      "  - {name: left, cloud_topic: l/points, camera_info_topic: l/info, largest_stamp_age_s: 0, latency_s: 0.1}\n");
  EXPECT_TRUE(shipped.depth_cameras.empty());
  ASSERT_EQ(own.depth_cameras.size(), 2U);
  EXPECT_EQ(own.depth_cameras[0].topics.depth + own.depth_cameras[0].topics.camera_info, "a/deptha/info");
  EXPECT_EQ(own.depth_cameras[0].range.max_m, 3.0);
  EXPECT_EQ(own.depth_cameras[1].name + own.depth_cameras[1].topics.cloud, "leftl/points");
  EXPECT_EQ(own.depth_cameras[1].topics.largest_stamp_age_s, 0.0);
  EXPECT_EQ(own.depth_cameras[1].latency_s, 0.1);
  EXPECT_EQ(own.workspace.clouds, (std::vector<std::int8_t>{100, 99, 3, -2}));
  EXPECT_TRUE(own.out.views && !own.workspace.meshes);
  EXPECT_EQ(own.master.handle.joy_axes, (std::array{0, 1, 2, 3, 4, 5}));
  EXPECT_EQ(own.master.handle.joy_enable, 7);
  EXPECT_EQ(own.camera.compressed_topic + own.camera.name, "igate");
  EXPECT_EQ(own.camera.rate_Hz, 5.0);
  EXPECT_FALSE(shipped.camera.wanted());
  EXPECT_EQ(own.points.depth + own.points.camera_info, "dc");
}

TEST(GatewayConfig, WhatDoesNotFitIsRefusedWithItsPlace) {
  EXPECT_THAT(refusal("master: {twist_topic: t, joy_topic: j}\n"), HasSubstr("joy_topic"));
  EXPECT_THAT(refusal("master: {joy_axes: [0, 1]}\n"), HasSubstr("has 2 axes; allowed: 6"));
  EXPECT_THAT(refusal("points: {depth_topic: d}\n"), HasSubstr("camera_info_topic"));
  EXPECT_THAT(refusal("points: {depth_topic: d, camera_info_topic: c, cloud_topic: p}\n"),
              HasSubstr("depth_topic"));
  EXPECT_THAT(refusal("camera: {image_topic: a, compressed_topic: b}\n"),
              HasSubstr("camera.compressed_topic: 'b' image_topic is given, too"));
  const auto cameras = [](const std::string& items) { return refusal("depth_cameras: [" + items + "]\n"); };
  EXPECT_THAT(cameras("{name: a, camera_info_topic: i}"), HasSubstr("neither is; allowed: one of them"));
  EXPECT_THAT(cameras("{name: a, image_topic: d, cloud_topic: c, camera_info_topic: i}"),
              HasSubstr("allowed: one of them"));
  EXPECT_THAT(cameras("{name: a, image_topic: d}"), HasSubstr("camera_info_topic"));
  EXPECT_THAT(cameras("{name: a, image_topic: d, camera_info_topic: i, min_depth_m: 6}"),
              HasSubstr("max_depth_m"));
  EXPECT_THAT(cameras("{name: a, image_topic: d, camera_info_topic: i}, {name: a, image_topic: e, "
                      "camera_info_topic: i}"),
              HasSubstr("another camera's"));
  EXPECT_THAT(refusal("camera: {name: \"\"}\n"), HasSubstr("1 to 32 bytes"));
  EXPECT_THAT(refusal("out: {clouds: [0]}\n"), HasSubstr("0; allowed: 100 (boundary)"));
  EXPECT_THAT(refusal("out: {clouds: [3, 3]}\n"), HasSubstr("3 is there twice"));
  EXPECT_THAT(refusal("out: {clouds: [101]}\n"), HasSubstr("clouds"));
  EXPECT_THAT(refusal("master: {largest_speed_m_s: 2}\n"), HasSubstr("largest_speed_m_s"));
}

}  // namespace
}  // namespace phantom::ros2_gateway::config_test
