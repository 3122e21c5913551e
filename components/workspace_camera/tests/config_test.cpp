#include "components/workspace_camera/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "common/runtime/configuration/fields.hpp"
#include "tests/support/files.hpp"

namespace phantom::workspace_camera::config_test {
namespace {

using testing::HasSubstr;

class Config : public testing::Test {
 protected:
  WorkspaceCameraConfig load(const std::string& yaml) const {
    std::ofstream(folder_ / "some.yaml") << yaml;
    return load_config(folder_ / "some.yaml");
  }
  void expect_refused(const std::string& yaml, const std::vector<std::string>& told) const {
    try {
      load(yaml);
      FAIL() << "accepted: " << yaml;
    } catch (const runtime::ConfigError& error) {
      EXPECT_THAT(error.what(), HasSubstr("some.yaml:"));
      for (const auto& part : told) EXPECT_THAT(error.what(), HasSubstr(part));
    }
  }
  std::filesystem::path folder_ = test::new_folder();
};

const std::string kOne = "cameras: [{name: a, pose: {xyz_m: [0, 0, 1]}}]";

TEST_F(Config, TheShippedFileIsValid) {
  const auto shipped = load_config(PHANTOM_SOURCE_DIR "/components/workspace_camera/workspace_camera.yaml");
  ASSERT_EQ(shipped.cameras.size(), 1U);
  EXPECT_EQ(shipped.cameras[0].driver, CameraDriver::kTopic);
  EXPECT_FALSE(shipped.has(CameraDriver::kSimulated));
  const auto defaults = load(kOne);
  EXPECT_EQ(shipped.heartbeat_s, defaults.heartbeat_s);
  EXPECT_EQ(shipped.status_rate_hz, defaults.status_rate_hz);
  EXPECT_EQ(shipped.whole_every_s, defaults.whole_every_s);
  EXPECT_EQ(shipped.late_s, defaults.late_s);
  EXPECT_EQ(shipped.dead_s, defaults.dead_s);
  EXPECT_EQ(shipped.on_loss, defaults.on_loss);
  EXPECT_EQ(shipped.fusion.max_blocks, defaults.fusion.max_blocks);
  EXPECT_EQ(shipped.fusion.sigma.at_1m_m, defaults.fusion.sigma.at_1m_m);
  EXPECT_EQ(shipped.fusion.min_component_vox, defaults.fusion.min_component_vox);
  EXPECT_EQ(shipped.fusion.masks.arm_margin_m, defaults.fusion.masks.arm_margin_m);
}

TEST_F(Config, ThatOfTheDemoIsValid) {
  const auto demo = load_config(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/workspace_camera.yaml");
  EXPECT_TRUE(demo.has(CameraDriver::kSimulated));
  EXPECT_EQ(demo.things.size(), 2U);
}

TEST_F(Config, ACameraThatLooksSomewhereIsHeldUpright) {
  const auto config = load("cameras: [{name: a, looks_from_m: [0, -1, 1], looks_at_m: [0, 0, 1]}]");
  const geometry::Pose& X = config.cameras[0].X_FC;
  EXPECT_TRUE((X * Eigen::Vector3d(0, 0, 1)).isApprox(Eigen::Vector3d(0, 0, 1)));
  EXPECT_TRUE((X.rotation * Eigen::Vector3d::UnitY()).isApprox(-Eigen::Vector3d::UnitZ()));
}

TEST_F(Config, WhatCannotBeIsRefusedWithItsPlace) {
  expect_refused("cameras: []", {"cameras", "allowed: 1 to 16"});
  expect_refused("cameras: [{name: a}]", {"pose"});
  expect_refused("cameras: [{name: a, pose: {}}, {name: a, pose: {}}]", {"another camera's", "each once"});
  expect_refused("cameras: [{name: a, looks_from_m: [0, 0, 1]}]", {"looks_at_m"});
  expect_refused("cameras: [{name: a, looks_from_m: [0, 0, 1], looks_at_m: [0, 0, 0]}]", {"straight above"});
  expect_refused(kOne + "\nlate_s: 0.5", {"dead_s", "not above late_s"});
  expect_refused(kOne + "\nthings: [{name: b, from_m: [0, 0, 0], size_m: [0, 1, 1]}]",
                 {"size_m", "0.001 to 10"});
  expect_refused(kOne + "\nthings: [{name: b, from_m: [0, 0, 0], stays_s: 5, every_s: 5}]", {"every_s"});
  expect_refused(kOne + "\nrate_hz: 3", {"rate_hz"});
}

TEST(Thing, IsThereFromTimeToTime) {
  Thing thing;
  thing.appears_s = 10.0, thing.stays_s = 2.0;
  EXPECT_FALSE(thing.is_there(9.9));
  EXPECT_TRUE(thing.is_there(10.0));
  EXPECT_FALSE(thing.is_there(12.0));
  EXPECT_FALSE(thing.is_there(30.5));
  thing.every_s = 20.0;
  EXPECT_TRUE(thing.is_there(30.5));
  EXPECT_FALSE(thing.is_there(33.0));
  thing.every_s = thing.stays_s = 0.0;
  EXPECT_TRUE(thing.is_there(1e5));
}

TEST(Thing, SwaysBetweenItsEnds) {
  Thing thing;
  thing.from_m = {1, 0, 0}, thing.to_m = {3, 0, 0}, thing.trip_s = 4.0, thing.appears_s = 10.0;
  EXPECT_NEAR(thing.middle_m(10.0).x(), 1.0, 1e-12);
  EXPECT_NEAR(thing.middle_m(11.0).x(), 2.0, 1e-12);
  EXPECT_NEAR(thing.middle_m(12.0).x(), 3.0, 1e-12);
  EXPECT_NEAR(thing.middle_m(14.0).x(), 1.0, 1e-12);
}

TEST_F(Config, UnknownSpaceHasAPolicy) {
  using enum fusion::UnknownPolicy;
  EXPECT_EQ(load(kOne).fusion.unknown, kIgnore);
  EXPECT_EQ(load(kOne + "\non_loss: end").fusion.unknown, kFree);
  EXPECT_EQ(load(kOne + "\non_loss: end\nfusion: {unknown: occupied}").fusion.unknown, kOccupied);
  const std::string region =
      "\nunknown_regions: [{min_m: [0, 0, 0.5], max_m: [1, 1, 0.9], policy: occupied}]";
  const auto regions = load(kOne + region).unknown_regions;
  ASSERT_EQ(regions.size(), 1U);
  EXPECT_EQ(regions[0].policy, kOccupied);
  EXPECT_EQ(regions[0].min_m, Eigen::Vector3d(0.0, 0.0, 0.5));
  EXPECT_THROW(load(kOne + "\nunknown_regions: [{min_m: [0, 0, 0.5], max_m: [1, 1, 0.5], policy: free}]"),
               core::ConfigError);
  EXPECT_THROW(load(kOne + "\nfusion: {unknown: solid}"), core::ConfigError);
}

}  // namespace
}  // namespace phantom::workspace_camera::config_test
