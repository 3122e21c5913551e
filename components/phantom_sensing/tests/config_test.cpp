#include "components/phantom_sensing/config.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/core/errors.hpp"
#include "components/phantom_sensing/model.hpp"
#include "tests/support/files.hpp"

namespace phantom::phantom_sensing {
namespace {

using testing::AllOf;
using testing::HasSubstr;

TEST(Config, TheShippedFileIsValidAndSaysTheDefaults) {
  const Config shipped = load_config(PHANTOM_SOURCE_DIR "/components/phantom_sensing/phantom_sensing.yaml");
  const Config defaults = load_config(test::new_file("{}"));
  EXPECT_EQ(shipped.arm, defaults.arm);
  EXPECT_EQ(shipped.percept_rate_hz, defaults.percept_rate_hz);
  EXPECT_EQ(shipped.staleness_s, defaults.staleness_s);
  EXPECT_EQ(shipped.skin.pitch_vox, defaults.skin.pitch_vox);
  EXPECT_EQ(shipped.skin.max_sensors, defaults.skin.max_sensors);
  EXPECT_EQ(shipped.skin.normalisation, defaults.skin.normalisation);
  const PerceptSettings &a = shipped.percept, &b = defaults.percept;
  EXPECT_EQ(a.mode, b.mode);
  EXPECT_EQ(a.directional.enabled, b.directional.enabled);
  EXPECT_EQ(a.directional.leaving_share, b.directional.leaving_share);
  EXPECT_EQ(a.directional.full_at, b.directional.full_at);
  EXPECT_EQ(a.directional.still, b.directional.still);
  EXPECT_EQ(a.threads, b.threads);
  EXPECT_EQ(a.gradient_reach_vox, b.gradient_reach_vox);
  EXPECT_EQ(a.cluster_reach_vox, b.cluster_reach_vox);
  EXPECT_EQ(a.cluster_shape, b.cluster_shape);
  EXPECT_EQ(a.motion.dangerous_below_rad, b.motion.dangerous_below_rad);
  EXPECT_EQ(a.motion.safe_above_rad, b.motion.safe_above_rad);
  EXPECT_EQ(a.hit.mu_unsafe, b.hit.mu_unsafe);
  EXPECT_EQ(a.hit.mu_moderate, b.hit.mu_moderate);
  EXPECT_EQ(a.hit.cosine, b.hit.cosine);
  EXPECT_EQ(a.hit.limit.points, b.hit.limit.points);
  EXPECT_EQ(a.hit.limit.mu, b.hit.limit.mu);
  EXPECT_EQ(a.hit.limit.speed_m_s, b.hit.limit.speed_m_s);
  EXPECT_EQ(a.alert.clear_after_s, b.alert.clear_after_s);
  EXPECT_EQ(a.alert.least_interval_s, b.alert.least_interval_s);
  EXPECT_EQ(a.alert.clear_speed_share, b.alert.clear_speed_share);
}

struct Fault {
  const char* name;
  const char* yaml;
  const char* key;
  const char* allowed;
};

class ConfigRefuses : public testing::TestWithParam<Fault> {};

TEST_P(ConfigRefuses, NamingFileKeyAndWhatIsAllowed) {
  const auto path = test::new_file(GetParam().yaml);
  try {
    load_config(path);
    FAIL() << "was accepted: " << GetParam().yaml;
  } catch (const core::ConfigError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr(path.filename().string()), HasSubstr(GetParam().key),
                                    HasSubstr(GetParam().allowed)));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Every, ConfigRefuses,
    testing::Values(
        Fault{"unknown_key", "surprise: 1", "surprise", "allowed"},
        Fault{"unknown_nested_key", "hit: {surprise: 1}", "surprise", "allowed"},
        Fault{"mode", "mode: both", "mode", "separable"},
        Fault{"normalisation", "normalisation: volume", "normalisation", "area"},
        Fault{"staleness", "staleness_s: 0", "staleness_s", "0.002 to 10 s"},
        Fault{"rate", "percept_rate_hz: fast", "percept_rate_hz", "number"},
        Fault{"pitch", "skin: {pitch_vox: 0}", "pitch_vox", "0.05 to 10 voxels"},
        Fault{"max_sensors", "skin: {max_sensors: 0}", "max_sensors", "allowed: 1 to "},
        Fault{"leaving_share", "directional: {leaving_share: 1.5}", "leaving_share", "0 to 1"},
        Fault{"full_at", "directional: {full_at: 0}", "full_at", "0.01 to 1"},
        Fault{"still", "directional: {still: 0}", "still", "1e-06 to 1 rad/s or m/s"},
        Fault{"threads", "threads: 65", "threads", "0 to 64 threads"},
        Fault{"reach", "cluster: {reach_vox: 16}", "reach_vox", "1 to 15 voxels"},
        Fault{"shape", "cluster: {shape: star}", "shape", "sphere"},
        Fault{"motion_order", "motion: {dangerous_below_deg: 130}", "safe_above_deg", "up to 180 degrees"},
        Fault{"mu_order", "hit: {mu_moderate_Pa_s_per_m: 40}", "mu_moderate_Pa_s_per_m", "below that"},
        Fault{"limit_lengths", "hit: {speed_limit_mu_Pa_s_per_m: [9, 32], speed_limit_m_s: [0.1]}",
              "speed_limit_m_s", "as many"},
        Fault{"limit_rises", "hit: {speed_limit_mu_Pa_s_per_m: [9, 32], speed_limit_m_s: [0.1, 0.2]}",
              "speed_limit_m_s", "must not rise"},
        Fault{"limit_shape", "hit: {speed_limit: steps}", "speed_limit", "linear, table"},
        Fault{"stale_before_behind", "workspace: {behind_after_s: 3, stale_after_s: 2}", "stale_after_s",
              "that or more"},
        Fault{"memory_first", "memory_weights: [0, 1]", "memory_weights", "the first above 0"},
        Fault{"memory_long", "memory_weights: [1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1]", "memory_weights",
              "up to 16"},
        Fault{"response_lengths", "response: {mu_Pa_s_per_m: [1, 2], felt_Pa_s_per_m: [1]}",
              "felt_Pa_s_per_m", "as many"},
        Fault{"share_name", "sharing: {shares: [{name: a b, links: [x]}]}", "name", "A-Z a-z 0-9"},
        Fault{"share_twice", "sharing: {shares: [{name: a, links: [x]}, {name: a, links: [y]}]}", "name",
              "a name of its own"},
        Fault{"share_links", "sharing: {shares: [{name: a, links: []}]}", "links",
              "at least one moving link"},
        Fault{"share_link_twice", "sharing: {shares: [{name: a, links: [x]}, {name: b, links: [x]}]}",
              "links", "each link once"},
        Fault{"share_many",
              "sharing: {shares: [{name: a, links: [p]}, {name: b, links: [q]}, {name: c, links: [r]}, "
              "{name: d, links: [s]}, {name: e, links: [t]}]}",
              "shares", "1 to 4"},
        Fault{"share_none", "sharing: {wait_s: 0.001}", "shares", "1 to 4"},
        Fault{"other_partition", "other_arms: [{arm: b, partition: a*}]", "partition", "A-Z a-z 0-9"},
        Fault{"others_many", "other_arms: [{arm: b}, {arm: c}, {arm: d}, {arm: e}, {arm: f}]", "other_arms",
              "up to 4"},
        Fault{"others_memory", "{memory_weights: [1, 1], other_arms: [{arm: b}]}", "memory_weights",
              "or no other_arms"},
        Fault{"others_sharing", "{other_arms: [{arm: b}], sharing: {shares: [{name: a, links: [x]}]}}",
              "other_arms", "one of them"},
        Fault{"share_memory", "{memory_weights: [1, 1], sharing: {shares: [{name: a, links: [x]}]}}",
              "memory_weights", "or no sharing"},
        Fault{"response_order", "response: {mu_Pa_s_per_m: [2, 1], felt_Pa_s_per_m: [1, 2]}", "mu_Pa_s_per_m",
              "rising"}),
    [](const auto& fault) { return std::string(fault.param.name); });

TEST(Model, TheShippedCellGivesAnArmInSkinAndAWorkspace) {
  const auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml");
  const Config config = load_config(test::new_file("{}"));
  const PhantomModel model = load_model(cell, config);
  EXPECT_EQ(model.arm.joint_count(), 7U);
  EXPECT_GT(model.skin.size(), 10'000U);
  const workspace::Workspace workspace = build_workspace(cell);
  EXPECT_GT(workspace.brick_count(), 50U);
  EXPECT_THAT(workspace.palette(),
              testing::IsSupersetOf({0.0F, 9.0F, 10.0F, 11.0F, 13.0F, 20.0F, 32.0F, 100.0F}));
  // The work table's plate lies below z = 0.3 m; just above it is its first layer.
  const auto above = workspace.grid().index_of({0.0, -0.2, 0.31});
  EXPECT_EQ(workspace.mu(above), 32.0F);
  EXPECT_EQ(workspace.object(above), 1);
}

TEST(Model, AnotherJointCountThanHomeIsRefused) {
  auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml");
  cell.arms[0].home.push_back(0.0);
  try {
    load_model(cell, load_config(test::new_file("{}")));
    FAIL();
  } catch (const core::ConfigError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("cell.yaml"), HasSubstr("home: has 8 values; allowed: 7")));
  }
}

TEST(Model, InterestPointsStandInTheFrameOfTheirMovingLink) {
  auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml");
  const PhantomModel model = load_model(cell, load_config(test::new_file("skin: {pitch_vox: 2}")));
  ASSERT_EQ(model.interest_points.size(), 4U);
  EXPECT_EQ(model.interest_points[3].name,
            "gripper");  // given in the frame of `tool`, fixed to the last link
  EXPECT_EQ(model.interest_points[3].link, 7U);
  EXPECT_NEAR(model.interest_points[3].position_m.z(), -0.16, 1e-12);
  cell.arms[0].interest_points[0].link = "tentacle";
  EXPECT_THAT(
      [&] { load_model(cell, load_config(test::new_file("{}"))); },
      testing::ThrowsMessage<core::ConfigError>(HasSubstr("'elbow' is on an unknown link 'tentacle'")));
}

TEST(Model, AllowedContactMustNameWhatThereIs) {
  auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml");
  const Config config = load_config(test::new_file("skin: {pitch_vox: 2}"));
  const PhantomModel model = load_model(cell, config);
  cell.arms[0].allowed_contact = {{"vice", "tool"}, {"pump", ""}};
  const percept::AllowedContact allowed = allowed_contact(cell, config, model);
  EXPECT_TRUE(allowed.mutes(7, 2));
  EXPECT_FALSE(allowed.mutes(6, 2));
  EXPECT_TRUE(allowed.mutes(1, 6));
  cell.arms[0].allowed_contact = {{"vise", ""}};
  EXPECT_THAT([&] { allowed_contact(cell, config, model); },
              testing::ThrowsMessage<core::ConfigError>(AllOf(HasSubstr("cell.yaml"), HasSubstr("'vise'"))));
}

TEST(Model, TooManySensorsAreRefused) {
  const auto cell = runtime::load_cell(PHANTOM_SOURCE_DIR "/deploy/cells/hot_cell/cell.yaml");
  EXPECT_THROW(load_model(cell, load_config(test::new_file("skin: {max_sensors: 500}"))), core::ConfigError);
  EXPECT_LT(load_model(cell, load_config(test::new_file("skin: {pitch_vox: 2}"))).skin.size(), 10'000U);
}

}  // namespace
}  // namespace phantom::phantom_sensing
