#include "components/synthetic_viewer/state/hand_limits.hpp"

#include <gmock/gmock.h>

#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell.hpp"

namespace phantom::synthetic_viewer {
namespace {

using testing::ElementsAre;

constexpr core::Nanoseconds kLimitsNow_ns = 100 * core::kNsPerSecond;

class HandLimits : public ::testing::Test {
 protected:
  HandLimits() {
    state_.arm.received_ns = state_.master.received_ns = kLimitsNow_ns;
    state_.arm.state = state_.master.state = LinkState::kCoupled;
    state_.arm.joint_count = 2;
    for (const char* name : {"lift", "yaw"}) {
      robot::Joint joint;
      joint.name = name;
      joint.lower = -1.0;
      joint.upper = 1.0;
      joints_.push_back(joint);
    }
  }
  std::vector<std::string> keys() const {
    std::vector<std::string> keys;
    for (const LocalizedText& words : hand_limits(state_, joints_, freedom_, {}, kLimitsNow_ns))
      keys.push_back(words.key);
    return keys;
  }

  ViewerState state_;
  std::vector<robot::Joint> joints_;
  double freedom_ = 0.3;
};

TEST_F(HandLimits, AreNoneWhileTheArmFollowsFreely) { EXPECT_THAT(keys(), ElementsAre()); }

TEST_F(HandLimits, NameWhatKeepsTheArmFromFollowingAndNothingBesideIt) {
  state_.master.percept_limited = true;
  const auto only = [&](const char* key) { EXPECT_THAT(keys(), ElementsAre(key)); };
  state_.arm.state = LinkState::kInit;
  only("limit.waits");
  state_.arm.state = LinkState::kReady;
  only("limit.alignment");
  state_.arm.state = LinkState::kAligned;
  only("limit.alignment");
  state_.arm.state = LinkState::kDegraded;
  only("limit.link");
  state_.arm.motion_permitted = false;
  only("limit.arm_switch");
  state_.master.motion_permitted = false;
  only("limit.master_switch");
  state_.master.received_ns = kLimitsNow_ns - core::kNsPerSecond;
  only("limit.master_silent");
  state_.arm.received_ns = 0;
  only("limit.arm_silent");
  state_.stops.in_force = true;
  only("limit.stopped");
}

TEST_F(HandLimits, NameAJointsEndBeforeTheGuards) {
  state_.master.percept_limited = state_.master.feedback_damped = state_.master.feedback_limited =
      state_.master.force_missing = true;
  state_.master.round_trip_s = 0.12;
  EXPECT_THAT(keys(), ElementsAre("limit.delay", "limit.damped", "limit.percept", "limit.no_force_sensor"));
  state_.arm.position[1] = 0.985;
  EXPECT_THAT(keys(), ElementsAre("limit.joint", "limit.delay", "limit.damped", "limit.percept",
                                  "limit.no_force_sensor"));
  const std::vector<LocalizedText> limits = hand_limits(state_, joints_, freedom_, {}, kLimitsNow_ns);
  EXPECT_EQ(english_text(limits[0]), "Joint yaw is at its end: it moves back only.");
  EXPECT_EQ(english_text(limits[1]), "The delay of 120.0 ms holds the force feedback at what is stable.");
  state_.arm.position[1] = 0.97;
  EXPECT_EQ(keys().front(), "limit.delay") << "not near enough";
  state_.arm.position[0] = -1.1;
  EXPECT_EQ(keys().front(), "limit.joint");
}

TEST_F(HandLimits, TellACapFromAGuardOfStability) {
  state_.master.percept_limited = true;
  ComponentSample status;
  status.component = "master_io";
  status.received_ns = kLimitsNow_ns;
  const auto with = [&](double guarded, double capped, double feedback_capped) {
    status.figures = {{"percept_guarded", guarded, ""},
                      {"percept_capped", capped, ""},
                      {"feedback_capped", feedback_capped, ""}};
    state_.components["master_io"] = status;
    return keys();
  };
  EXPECT_THAT(with(0.0, 0.2, 0.0), ElementsAre("limit.percept_capped"));
  EXPECT_THAT(with(0.1, 0.0, 0.0), ElementsAre("limit.percept"));
  EXPECT_THAT(with(0.1, 0.2, 0.0), ElementsAre("limit.percept", "limit.percept_capped"));
  EXPECT_THAT(with(0.0, 0.0, 0.0), ElementsAre()) << "the status that tells which is on its way";
  state_.master.percept_limited = false;
  EXPECT_THAT(with(0.1, 0.2, 0.3), ElementsAre("limit.feedback_capped")) << "what held the drag back is over";
  state_.master.percept_limited = true;
  status.received_ns = kLimitsNow_ns - 2 * core::kNsPerSecond;
  EXPECT_THAT(with(0.0, 0.2, 0.3), ElementsAre("limit.percept")) << "an old status tells nothing";
}

TEST_F(HandLimits, TellOfDragThatTheFeedbackMasks) {
  ComponentSample status;
  status.component = "master_io";
  status.received_ns = kLimitsNow_ns;
  const auto with = [&](double masked) {
    status.figures = {{"percept_guarded", 0.0, ""}, {"percept_capped", 0.0, ""}, {"drag_masked", masked, ""}};
    state_.components["master_io"] = status;
    return keys();
  };
  EXPECT_THAT(with(0.9), ElementsAre("limit.masked"));
  EXPECT_THAT(with(0.1), ElementsAre()) << "it ended within the status";
}

TEST_F(HandLimits, NameASingularPose) {
  state_.master.feedback_damped = true;
  freedom_ = 0.01;
  EXPECT_THAT(keys(), ElementsAre("limit.singular", "limit.damped"));
  freedom_ = 0.03;
  EXPECT_THAT(keys(), ElementsAre("limit.damped"));
}

// Tries a SCARA that is stretched, almost so, and bent, and the home poses of shipped arms.
TEST(ToolFreedom, IsNothingWhereTheArmIsStretchedAndGrowsAsItBends) {
  const auto arm_of = [](const char* cell, const char* name) {
    return runtime::load_arm(
        runtime::load_cell(std::string(PHANTOM_SOURCE_DIR "/deploy/cells/") + cell + "/cell.yaml").arm(name));
  };
  const robot::SerialArm scara = arm_of("scara_pair", "scara_a");
  EXPECT_NEAR(tool_freedom(scara, {0.3, 0.0, 0.05, 0.0}), 0.0, 1e-6);
  EXPECT_LT(tool_freedom(scara, {0.3, 0.02, 0.05, 0.0}), 0.02);
  EXPECT_GT(tool_freedom(scara, {0.3, 1.2, 0.05, 0.0}), 0.1);
  EXPECT_GT(tool_freedom(arm_of("hot_cell", ""), {-0.1, -1.5708, 1.4, -2.2, 0.0, 0.9, 0.0}), 0.05) << "home";
}

}  // namespace
}  // namespace phantom::synthetic_viewer
