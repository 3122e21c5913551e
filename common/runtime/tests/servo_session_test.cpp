#include "common/runtime/servo_session.hpp"

#include <gtest/gtest.h>

namespace phantom::runtime {
namespace {

TEST(WithActuator, TroubleWithItIsToldBeforeAllElse) {
  using core::ComponentState;
  using teleop::LinkState;
  const core::Health link{ComponentState::kReady, "waiting", {}, {{"reach", 1, ""}}};
  const core::ActuatorHealth sound{.figures = {{"clearance", 0.1, "m"}}};
  EXPECT_EQ(with_actuator(link, sound, LinkState::kReady).message, "waiting");
  EXPECT_EQ(with_actuator(link, sound, LinkState::kReady).figures.size(), 2U);
  const core::ActuatorHealth starting{.follows = false, .message = "j3 starts"};
  EXPECT_EQ(with_actuator(link, starting, LinkState::kReady).state, ComponentState::kStarting);
  EXPECT_EQ(with_actuator(link, starting, LinkState::kReady).message, "j3 starts");
  EXPECT_EQ(with_actuator(link, starting, LinkState::kStopped).message, "waiting")
      << "a stop takes its power";
  const core::ActuatorHealth faulty{.fault = true, .follows = false, .message = "j3 is in fault"};
  for (const LinkState state : {LinkState::kReady, LinkState::kStopped}) {
    EXPECT_EQ(with_actuator(link, faulty, state).state, ComponentState::kFault);
    EXPECT_EQ(with_actuator(link, faulty, state).message, "j3 is in fault");
  }
}

}  // namespace
}  // namespace phantom::runtime
