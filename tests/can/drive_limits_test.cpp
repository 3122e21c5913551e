// What the master has a drive watch by itself: following error and position limits, against the simulated
// drive.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/can/rig.hpp"

namespace phantom {
namespace {

using can::DriveFault;
using can::DriveGroupState;
using can::DriveMode;
using test::group_config;
using test::Rig;
using testing::HasSubstr;

constexpr double kCountsPerRad = test::kCounts * test::kGear / 6.283185307179586;

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
    EXPECT_EQ(rig.drives[0]->dictionary().value(0x6065), std::llround(std::ceil(0.05 * kCountsPerRad)));
    EXPECT_EQ(rig.drives[0]->dictionary().value(0x6066), 25);
  }
}

TEST(FollowingWindow, LeftOutTheDriveKeepsItsOwn) {
  simulated_drive::DriveOptions options;
  options.following_window_rad = 0.3;
  Rig rig(group_config(DriveMode::kPosition, 1), options);
  ASSERT_TRUE(rig.bring_up());
  EXPECT_EQ(rig.drives[0]->dictionary().value(0x6065), std::llround(0.3 * kCountsPerRad));
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

}  // namespace
}  // namespace phantom
