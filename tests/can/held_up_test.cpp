// The master is held up by its host: what its drives do meanwhile, and what a late cycle does.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/can/rig.hpp"

namespace phantom::held_up_test {
namespace {

using can::DriveGroupState;
using can::DriveMode;
using can::FaultReaction;
using test::group_config;
using test::Rig;
using Power = simulated_drive::SimulatedDrive::Power;

// The heartbeat alone would let the last torque act for half a second.
// Tries slave_io: stands still
// Tries master_io: master_io dies; stands still
// Tries simulated_drive: its targets stop coming
TEST(HeldUp, SR18_DrivesWhoseTargetsStopComingHoldOrCoastByThemselvesLongBeforeTheHeartbeatIsMissed) {
  for (const FaultReaction reaction : {FaultReaction::kHold, FaultReaction::kCoast}) {
    auto config = group_config(DriveMode::kTorque, 2, reaction);
    config.timing.heartbeat_timeout_s = 0.5;
    config.timing.target_timeout_s = 0.02;
    simulated_drive::DriveOptions options;
    options.motor.joint = {.inertia = 0.5, .viscous = 0.0, .coulomb = 0.0};
    Rig rig(config, options);
    ASSERT_TRUE(rig.bring_up());
    rig.command.torque.fill(2.0);
    rig.run(0.1);
    rig.master_frozen = true;
    rig.run(0.016);
    for (const auto& drive : rig.drives) EXPECT_EQ(drive->power(), Power::kEnabled) << "a short gap is borne";
    rig.run(0.008);
    const Power wanted = reaction == FaultReaction::kHold ? Power::kQuickStop : Power::kSwitchOnDisabled;
    for (const auto& drive : rig.drives) EXPECT_EQ(drive->power(), wanted);
    rig.run(0.1);
    rig.master_frozen = false;
    rig.run(0.1);
    EXPECT_EQ(rig.state(), DriveGroupState::kFault) << "found, and latched until a reset";
    EXPECT_THAT(rig.group->sentence(), testing::HasSubstr("its targets stopped coming (0x8250)"));
  }
}

// Its own limit lies below that of the master, which finds a drive that has none.
// Tries slave_io: stands still
TEST(HeldUp, SR18_ADriveInTorqueModeThatHasASpeedLimitKeepsItWhateverTorqueActs) {
  simulated_drive::DriveOptions options;
  options.motor.joint = {.inertia = 0.5, .viscous = 0.0, .coulomb = 0.0};
  for (const bool has_limit : {true, false}) {
    Rig rig(group_config(DriveMode::kTorque, 1), options);
    rig.drives[0]->misbehaviour.ignore_max_speed = !has_limit;
    ASSERT_TRUE(rig.bring_up());
    rig.command.torque[0] = -5.0;
    rig.run(0.3);
    const double speed_rad_s = rig.drives[0]->motor().joint_rad_s();
    if (has_limit) {
      EXPECT_GT(speed_rad_s, -1.2) << "at a limit of 1 rad/s";
      EXPECT_EQ(rig.state(), DriveGroupState::kEnabled);
    } else {
      EXPECT_EQ(rig.drive(0).fault, can::DriveFault::kImplausible);
      EXPECT_THAT(rig.group->sentence(), testing::HasSubstr("rad/s by its position; allowed: at most 2"));
    }
  }
}

// Tries simulated_drive: the master's heartbeat stops
TEST(HeldUp, ADriveWhoseMasterFallsSilentDoesAsItsObject6007Says) {
  const std::array wanted{Power::kEnabled, Power::kFault, Power::kSwitchOnDisabled, Power::kQuickStop};
  for (std::uint8_t option = 0; option < wanted.size(); ++option) {
    Rig rig(group_config(DriveMode::kVelocity, 1));
    ASSERT_TRUE(rig.bring_up());
    auto tool = rig.bus.connect("tool");
    tool->send({.id = 0x601, .length = 8, .data = {0x2B, 0x07, 0x60, 0, option, 0, 0, 0}});
    rig.run(0.05);
    ASSERT_EQ(rig.drives[0]->power(), Power::kEnabled);
    rig.master_frozen = true;
    rig.run(0.5);
    EXPECT_EQ(rig.drives[0]->power(), wanted[option]) << int{option};
  }
}

TEST(HeldUp, SR18_TheTargetsOfALateCycleActWithItsOwnSync) {
  for (const bool hasten : {false, true}) {
    Rig rig(group_config(DriveMode::kTorque, 1));
    ASSERT_TRUE(rig.bring_up());
    rig.command.torque[0] = 3.0;
    rig.run(0.02);
    ASSERT_NEAR(rig.group->report().torque[0], 3.0, 0.01);
    rig.command.torque[0] = 0.0;
    rig.command.hasten = hasten;
    rig.cycle();
    EXPECT_EQ(rig.drives[0]->torque_mille() == 0.0, hasten);
  }
}

}  // namespace
}  // namespace phantom::held_up_test
