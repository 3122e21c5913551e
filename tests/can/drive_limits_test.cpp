// What the master has a drive watch by itself: following error and position limits, against the simulated
// drive.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "tests/can/rig.hpp"

namespace phantom {
namespace {

using can::DriveFault;
using can::DriveGroupState;
using can::DriveMode;
using test::group_config;
using test::Rig;
using testing::HasSubstr;

/// A joint that friction holds fast, whatever its motor does.
simulated_drive::DriveOptions blocked() {
  simulated_drive::DriveOptions options;
  options.motor.joint.coulomb = 1000.0;
  return options;
}

can::DriveGroupConfig with_window(DriveMode mode, double window_rad, double time_s) {
  auto config = group_config(mode, 1);
  config.axes[0].following_window = window_rad;
  config.axes[0].following_time_s = time_s;
  return config;
}

TEST(FollowingWindow, IsWrittenInTheDrivesCountsAndMilliseconds) {
  for (const int sign : {1, -1}) {
    auto config = with_window(DriveMode::kPosition, 0.05, 0.025);
    config.axes[0].units.sign = sign;
    Rig rig(config);
    ASSERT_TRUE(rig.bring_up()) << rig.group->sentence();
    EXPECT_EQ(rig.drives[0]->dictionary().value(0x6065), std::llround(std::ceil(0.05 * test::kCountsPerRad)));
    EXPECT_EQ(rig.drives[0]->dictionary().value(0x6066), 25);
  }
}

TEST(FollowingWindow, LeftOutTheDriveKeepsItsOwn) {
  simulated_drive::DriveOptions options;
  options.following_window_rad = 0.3;
  Rig rig(group_config(DriveMode::kPosition, 1), options);
  ASSERT_TRUE(rig.bring_up());
  EXPECT_EQ(rig.drives[0]->dictionary().value(0x6065), std::llround(0.3 * test::kCountsPerRad));
  EXPECT_EQ(rig.drives[0]->dictionary().value(0x6066), 10);
}

// The fault comes when the reference has left the window, and the time after it; not before, and not without.
TEST(FollowingWindow, ABlockedJointIsAFaultOnceItsTargetHasLeftTheWindow) {
  for (const DriveMode mode : {DriveMode::kPosition, DriveMode::kVelocity}) {
    for (const double window_rad : {0.02, 0.1}) {
      Rig rig(with_window(mode, window_rad, 0.03), blocked());
      ASSERT_TRUE(rig.bring_up());
      rig.command.position[0] = 2.0;
      rig.command.velocity[0] = 1.0;  // as fast as the position's target: max_speed
      const double took_ms = rig.run_until([&] { return rig.state() == DriveGroupState::kFault; }, 1.0);
      EXPECT_NEAR(took_ms, 1e3 * (window_rad + 0.03), 10.0);
      EXPECT_THAT(rig.group->sentence(), HasSubstr("j1 is in fault: following error (0x8611)"));
    }
  }
}

// A drive that only shows it in its statusword and goes on is stopped by the master.
TEST(FollowingWindow, BitThirteenIsAFaultToo) {
  Rig rig(with_window(DriveMode::kPosition, 0.02, 0.0), blocked());
  rig.drives[0]->misbehaviour.only_show_following_error = true;
  ASSERT_TRUE(rig.bring_up());
  rig.command.position[0] = 2.0;
  rig.run(0.2);
  EXPECT_EQ(rig.drive(0).fault, DriveFault::kFollowingError);
  EXPECT_THAT(rig.group->sentence(), HasSubstr("j1 is too far from its target (following error)"));
  EXPECT_EQ(rig.drives[0]->power(), simulated_drive::SimulatedDrive::Power::kQuickStop);
  rig.command.position[0] = 0.0;
  rig.reset();
  EXPECT_TRUE(rig.bring_up()) << "its cause is gone: where the joint stands is its target again";
}

// In torque mode the bit means something else, or nothing.
TEST(FollowingWindow, BitThirteenIsHeededInPositionModeAlone) {
  for (const DriveMode mode : {DriveMode::kVelocity, DriveMode::kTorque}) {
    Rig rig(group_config(mode, 1));
    rig.drives[0]->misbehaviour.other_status_bits = 0x2000;
    EXPECT_TRUE(rig.bring_up()) << rig.group->sentence();
    rig.run(0.5);
    EXPECT_EQ(rig.state(), DriveGroupState::kEnabled);
  }
}

TEST(FollowingWindow, ADriveWithoutItIsRefusedAloud) {
  for (const std::uint16_t object : {std::uint16_t{0x6065}, std::uint16_t{0x6066}}) {
    Rig rig(with_window(DriveMode::kPosition, 0.05, 0.025));
    rig.drives[0]->misbehaviour.lacks_object = object;
    rig.run(1.0);
    EXPECT_EQ(rig.drive(0).fault, DriveFault::kSetupRefused);
    EXPECT_THAT(rig.group->sentence(),
                HasSubstr(object == 0x6065 ? "refuses object 0x6065:0: no such object"
                                           : "refuses object 0x6066:0: no such object"));
    Rig other(group_config(DriveMode::kPosition, 1));
    other.drives[0]->misbehaviour.lacks_object = object;
    EXPECT_TRUE(other.bring_up()) << "nobody asked for it";
  }
}

TEST(FollowingWindow, WhatMakesNoSenseIsRefusedByName) {
  EXPECT_THAT(can::check(with_window(DriveMode::kTorque, 0.05, 0.025)).message(),
              HasSubstr("j1.following_window: a drive in torque mode"));
  EXPECT_THAT(can::check(with_window(DriveMode::kPosition, 0.0, 0.025)).message(),
              HasSubstr("j1.following_window: 0; allowed: greater than 0"));
  EXPECT_THAT(can::check(with_window(DriveMode::kPosition, 1e6, 0.025)).message(),
              HasSubstr("j1.following_window"));
  EXPECT_THAT(can::check(with_window(DriveMode::kPosition, 0.05, 70.0)).message(),
              HasSubstr("j1.following_time_s: 70; allowed: 0 to 65.535"));
  EXPECT_TRUE(can::check(with_window(DriveMode::kVelocity, 0.05, 0.0)));
}

can::DriveGroupConfig with_margin(DriveMode mode, double margin_rad) {
  auto config = group_config(mode, 1);
  config.axes[0].limits_margin = margin_rad;
  return config;
}

// Whatever sign, offset, gear and range: the drive's limits are those of the joint, in its counts, least
// first.
TEST(PositionLimits, AreTheJointsWithTheMarginInEveryUnit) {
  std::mt19937 random(7);
  const auto between = [&](double a, double b) { return std::uniform_real_distribution<>(a, b)(random); };
  for (int i = 0; i < 40; ++i) {
    auto config = with_margin(i % 2 ? DriveMode::kPosition : DriveMode::kTorque, between(0.0, 0.3));
    can::AxisConfig& axis = config.axes[0];
    axis.units.sign = i % 3 ? 1 : -1;
    axis.units.offset = between(-2.0, 2.0);
    axis.lower = between(-3.0, -0.1);
    axis.upper = between(0.1, 3.0);
    Rig rig(config);
    rig.run(0.3);
    ASSERT_TRUE(can::check(config));
    const auto& od = rig.drives[0]->dictionary();
    const double ends[] = {
        axis.units.sign * (axis.lower - *axis.limits_margin - axis.units.offset) * test::kCountsPerRad,
        axis.units.sign * (axis.upper + *axis.limits_margin - axis.units.offset) * test::kCountsPerRad};
    EXPECT_NEAR(static_cast<double>(od.value(0x607D, 1)), std::min(ends[0], ends[1]), 0.51);
    EXPECT_NEAR(static_cast<double>(od.value(0x607D, 2)), std::max(ends[0], ends[1]), 0.51);
    EXPECT_LT(od.value(0x607D, 1), od.value(0x607D, 2));
  }
}

TEST(PositionLimits, AreCutAtTheDrivesThirtyTwoBits) {
  auto config = with_margin(DriveMode::kPosition, 0.5);
  config.axes[0].units.counts_per_turn = 8.9e8;  // ±3 rad just fit, with the gear; the margin does not
  ASSERT_TRUE(can::check(config)) << can::check(config).message();
  Rig rig(config);
  rig.run(0.3);
  EXPECT_EQ(rig.drives[0]->dictionary().value(0x607D, 1), INT32_MIN);
  EXPECT_EQ(rig.drives[0]->dictionary().value(0x607D, 2), INT32_MAX);
}

TEST(PositionLimits, NoneAreWrittenWithoutAMarginOrForAContinuousJoint) {
  const auto writes = [](const can::DriveGroupConfig& config) {
    const auto steps = can::setup_steps(config.axes[0], config);
    return std::count_if(steps.begin(), steps.end(), [](const auto& step) { return step.index == 0x607D; });
  };
  auto config = with_margin(DriveMode::kPosition, 0.1);
  EXPECT_EQ(writes(config), 2);
  config.axes[0].limits_margin.reset();
  EXPECT_EQ(writes(config), 0);
  config.axes[0].limits_margin = 0.1;
  config.axes[0].lower = -std::numeric_limits<double>::infinity();
  config.axes[0].upper = std::numeric_limits<double>::infinity();
  EXPECT_EQ(writes(config), 0);
}

// The master's own range is 3 rad; the drive's limit is then made less, as somebody might with a tool.
TEST(PositionLimits, TheDriveCutsWhatLiesBeyondThemExceptInTorqueMode) {
  for (const DriveMode mode : {DriveMode::kPosition, DriveMode::kVelocity, DriveMode::kTorque}) {
    Rig rig(with_margin(mode, 0.0));
    auto tool = rig.bus.connect("tool");
    ASSERT_TRUE(rig.bring_up());
    EXPECT_EQ(rig.drive(0).statusword & 0x0800, 0) << "no internal limit is active";
    const auto limit = static_cast<std::uint32_t>(std::llround(1.0 * test::kCountsPerRad));
    can::CanFrame write{.id = 0x601, .length = 8, .data = {0x23, 0x7D, 0x60, 0x02}};
    can::put_le(std::span(write.data).subspan(4), limit, 4);
    tool->send(write);
    rig.command.position[0] = 2.0;
    rig.command.velocity[0] = 0.8;
    rig.command.torque[0] = mode == DriveMode::kTorque ? 1.0 : 0.0;
    rig.run(3.0);
    if (mode == DriveMode::kTorque) {
      EXPECT_GT(rig.drives[0]->motor().joint_rad(), 1.5);
      EXPECT_EQ(rig.drive(0).statusword & 0x0800, 0);
    } else {
      // In velocity mode it brakes from there: v²/2a with 5 N·m on 0.5 kg·m².
      EXPECT_NEAR(rig.drives[0]->motor().joint_rad(), 1.0, mode == DriveMode::kPosition ? 0.001 : 0.035);
      EXPECT_NE(rig.drive(0).statusword & 0x0800, 0);
    }
  }
}

TEST(PositionLimits, NegativeMarginsAndDrivesWithoutLimitsAreRefused) {
  EXPECT_THAT(can::check(with_margin(DriveMode::kPosition, -0.1)).message(),
              HasSubstr("j1.limits_margin: -0.1"));
  Rig rig(with_margin(DriveMode::kPosition, 0.1));
  rig.drives[0]->misbehaviour.lacks_object = 0x607D;
  rig.run(1.0);
  EXPECT_THAT(rig.group->sentence(), HasSubstr("refuses object 0x607D:1: no such object"));
}

}  // namespace
}  // namespace phantom
