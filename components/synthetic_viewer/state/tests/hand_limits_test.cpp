#include "components/synthetic_viewer/state/hand_limits.hpp"

#include <gmock/gmock.h>

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
    for (const LocalizedText& words : hand_limits(state_, joints_, {}, kLimitsNow_ns))
      keys.push_back(words.key);
    return keys;
  }

  ViewerState state_;
  std::vector<robot::Joint> joints_;
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
  const std::vector<LocalizedText> limits = hand_limits(state_, joints_, {}, kLimitsNow_ns);
  EXPECT_EQ(english_text(limits[0]), "Joint yaw is at its end: it moves back only.");
  EXPECT_EQ(english_text(limits[1]), "The delay of 120 ms holds the force feedback at what is stable.");
  state_.arm.position[1] = 0.97;
  EXPECT_EQ(keys().front(), "limit.delay") << "not near enough";
  state_.arm.position[0] = -1.1;
  EXPECT_EQ(keys().front(), "limit.joint");
}

}  // namespace
}  // namespace phantom::synthetic_viewer
