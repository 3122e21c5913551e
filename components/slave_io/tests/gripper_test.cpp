// The gripper in the servo of slave_io, simulated; its requests and its parameters.
#include "components/slave_io/gripper.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "components/slave_io/tests/gripper_bench.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::slave_io {
namespace {

using teleop::LinkState;
using testing::HasSubstr;
TEST(GripperInServo, ClosesOnAnObjectAndSaysWhatItHolds) {
  GripperBench bench;
  bench.run(0.5);
  EXPECT_TRUE(bench.state_of_it().open);
  ASSERT_TRUE(bench.inbox.gripper.ask_force(20.0));
  ASSERT_TRUE(bench.inbox.gripper.ask_width(0.0));
  bench.run(0.3);
  EXPECT_TRUE(bench.state_of_it().moves);
  bench.run(0.7);
  const messages::GripperState& state = bench.state_of_it();
  EXPECT_TRUE(state.holds && !state.moves && !state.closed);
  EXPECT_NEAR(state.sense.width_m, 0.042, 0.002);
  EXPECT_NEAR(state.sense.force_N, 20.0, 1e-6);
  EXPECT_EQ(state.requested_width_m, 0.0);
  EXPECT_EQ(state.requested_force_N, 20.0);
  EXPECT_EQ(state.widest_m, 0.1);
  EXPECT_EQ(state.greatest_force_N, 60.0);
  EXPECT_EQ(bench.state(), LinkState::kCoupled);
}

TEST(GripperInServo, HoldsOnThroughALostLinkAStopAndAReset) {
  GripperBench bench;
  bench.grip();
  const auto expect_held = [&](const char* when) {
    bench.run(3.0);
    EXPECT_TRUE(bench.state_of_it().holds) << when;
    EXPECT_GT(bench.arm.plant().gripper()->object_force_N(), 28.0) << when;
  };
  bench.heard = false;
  bench.run(0.5);
  ASSERT_EQ(bench.state(), LinkState::kDegraded);
  expect_held("the link is lost");
  bench.heard = true;
  expect_held("the link is back");
  bench.inbox.stops.stop();
  bench.run(0.1);
  ASSERT_EQ(bench.state(), LinkState::kStopped);
  expect_held("stopped");
  EXPECT_THAT(bench.inbox.gripper.ask_width(0.1).message(),
              HasSubstr("the arm is stopped; allowed: after a reset"));
  EXPECT_THAT(bench.inbox.gripper.ask_force(5.0).message(), HasSubstr("stopped"));
  bench.inbox.stops.reset({.own = bench.stops.record.id});
  expect_held("reset");
  ASSERT_NE(bench.state(), LinkState::kStopped);
  ASSERT_TRUE(bench.inbox.gripper.ask_width(1.0));
  bench.run(1.0);
  EXPECT_TRUE(bench.state_of_it().open);
  EXPECT_EQ(bench.arm.plant().gripper()->object_force_N(), 0.0);
}

TEST(GripperInServo, AStopOrALostLinkEndsAMotion) {
  for (const bool stop : {true, false}) {
    GripperBench bench;
    bench.run(0.5);
    ASSERT_TRUE(bench.inbox.gripper.ask_width(0.0));
    bench.run(0.2);
    if (stop) bench.inbox.stops.stop();
    bench.heard = stop;
    bench.run(0.1);
    const double at_m = bench.state_of_it().sense.width_m;
    bench.heard = true;
    if (stop) bench.inbox.stops.reset({.own = bench.stops.record.id});
    bench.run(2.0);
    EXPECT_NEAR(bench.state_of_it().sense.width_m, at_m, 1e-3) << stop;
    EXPECT_FALSE(bench.state_of_it().moves);
    EXPECT_EQ(bench.state(), LinkState::kCoupled);
  }
}

// One that was on its way while the stop came in force is ended before the fingers have moved by a
// millimetre.
TEST(GripperInServo, ARequestThatAStopOvertookMovesNothing) {
  GripperBench bench;
  bench.grip();
  ASSERT_TRUE(bench.inbox.gripper.ask_width(1.0));
  bench.inbox.stops.stop();
  bench.run(1.0);
  EXPECT_LT(bench.state_of_it().sense.width_m, 0.0425);
}

TEST(GripperInServo, WithoutAGripperOrOutOfItsRangeARequestIsRefused) {
  GripperRequests none;
  EXPECT_THAT(none.ask_width(0.0).message(), HasSubstr("the arm has none"));
  GripperBench bench;
  EXPECT_THAT(bench.inbox.gripper.ask_width(0.0).message(), HasSubstr("not ready yet"));
  bench.run(0.01);
  EXPECT_THAT(bench.inbox.gripper.ask_force(61.0).message(), HasSubstr("force is 61; allowed: 3 to 60 N"));
  EXPECT_THAT(bench.inbox.gripper.ask_force(0.0).message(), HasSubstr("allowed: 3 to 60 N"));
}

TEST(GripperInServo, TickDoesNotAllocate) {
  GripperBench bench;
  bench.run(0.5);
  ASSERT_TRUE(bench.inbox.gripper.ask_width(0.0));
  const test::HeapGuard guard;
  bench.run(1.0);
}

TEST(GripperHealth, TroubleWithItShowsWhereTheArmHasNone) {
  messages::GripperState state;
  state.sense.width_m = 0.04;
  const core::ActuatorHealth fault{true, false, "is in fault", {}};
  core::Health health = with_gripper({core::ComponentState::kRunning, "", {}, {}}, fault, state);
  EXPECT_EQ(health.state, core::ComponentState::kDegraded);
  EXPECT_THAT(health.message, HasSubstr("gripper: is in fault"));
  EXPECT_EQ(health.figures.at(0).value, 0.04);
  health = with_gripper({core::ComponentState::kStopped, "stopped", {}, {}}, fault, state);
  EXPECT_EQ(health.message, "stopped");
  EXPECT_EQ(health.state, core::ComponentState::kStopped);
  EXPECT_EQ(with_gripper({core::ComponentState::kRunning, "", {}, {}}, {}, state).state,
            core::ComponentState::kRunning);
}

TEST(GripperConfig, WhatCannotBeIsRefused) {
  const auto problem = [](const std::string& from, const std::string& to) {
    std::string section = kGripperSection;
    section.replace(section.find(from), from.size(), to);
    return problem_of_changed("force_sensor:", section);
  };
  EXPECT_EQ(problem_of_changed("force_sensor:", kGripperSection), "accepted");
  EXPECT_THAT(problem("widest_m: 0.1", "widest_m: 2"), HasSubstr("gripper.widest_m"));
  EXPECT_THAT(problem("widest_m: 0.1, ", ""), HasSubstr("widest_m"));
  EXPECT_THAT(problem("greatest_force_N: 60", "greatest_force_N: 2"),
              HasSubstr("is less than least_force_N"));
  EXPECT_THAT(problem("force_N: 30", "force_N: 61"), HasSubstr("gripper.force_N"));
  EXPECT_THAT(problem("object_width_m: 0.042", "object_width_m: 0.2"), HasSubstr("does not fit"));
  EXPECT_THAT(problem("object_width_m: 0.042", "friction_N: 4"), HasSubstr("friction_N"));
  EXPECT_THAT(problem("object_width_m: 0.042", "finger_mass_kg: 0.02"), HasSubstr("such light fingers"));
  EXPECT_EQ(problem("object_width_m: 0.042", "pad_friction: 0.9"), "accepted");
  EXPECT_THAT(problem("object_width_m: 0.042", "pad_friction: 2.5"), HasSubstr("gripper.pad_friction"));
  EXPECT_THAT(problem("object_width_m: 0.042", "object_widht_m: 0.042"), HasSubstr("object_widht_m"));
}

}  // namespace
}  // namespace phantom::slave_io
