#include "common/runtime/servo/servo_session.hpp"

#include <gtest/gtest.h>

namespace phantom::runtime {
namespace {

TEST(WithActuator, TroubleWithItIsToldBeforeAllElse) {
  using core::ComponentState;
  const teleop::SideOutputs kReady{.state = teleop::LinkState::kReady},
      kStopped{.state = teleop::LinkState::kStopped};
  const core::Health link{ComponentState::kReady, "waiting", {}, {{"reach", 1, ""}}};
  const core::ActuatorHealth sound{.figures = {{"clearance", 0.1, "m"}}};
  EXPECT_EQ(with_actuator(link, sound, kReady).message, "waiting");
  EXPECT_EQ(with_actuator(link, sound, kReady).figures.size(), 2U);
  const core::ActuatorHealth starting{.follows = false, .message = "j3 starts"};
  EXPECT_EQ(with_actuator(link, starting, kReady).state, ComponentState::kStarting);
  EXPECT_EQ(with_actuator(link, starting, kReady).message, "j3 starts");
  EXPECT_EQ(with_actuator(link, starting, kStopped).message, "waiting") << "a stop takes its power";
  const core::ActuatorHealth faulty{.fault = true, .follows = false, .message = "j3 is in fault"};
  for (const auto& state : {kReady, kStopped}) {
    EXPECT_EQ(with_actuator(link, faulty, state).state, ComponentState::kFault);
    EXPECT_EQ(with_actuator(link, faulty, state).message, "j3 is in fault");
  }
}

// Tries slave_io: the servo's loop is held up
TEST(WithActuator, SR18_AServoThatIsHeldUpIsToldWithHowOftenAndForHowLong) {
  using core::ComponentState;
  const core::Health link{ComponentState::kReady, "waiting", {}, {}};
  teleop::SideOutputs now{.state = teleop::LinkState::kDegraded};
  now.loop = {.starved = true, .late_ticks = 7, .window_s = 1.0, .longest_gap_s = 0.048};
  const core::ActuatorHealth withheld{.follows = false, .message = "power is withheld"};
  EXPECT_EQ(with_actuator(link, withheld, now).state, ComponentState::kDegraded);
  EXPECT_EQ(
      with_actuator(link, withheld, now).message,
      "the servo loop was held up 7 times within 1 s, by up to 48 ms: uncoupled, the drives hold or coast "
      "by themselves");
  const core::ActuatorHealth faulty{.fault = true, .follows = false, .message = "j3 is in fault"};
  EXPECT_EQ(with_actuator(link, faulty, now).message, "j3 is in fault");
  now.state = teleop::LinkState::kStopped;
  EXPECT_EQ(with_actuator(link, withheld, now).message, "waiting") << "a stop is the greater news";
}

}  // namespace
}  // namespace phantom::runtime
