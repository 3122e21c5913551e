// The master's drive code against the independent simulated drive: what works when all is well.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/can/rig.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::drive_test {
namespace {

using can::DriveFault;
using can::DriveGroupState;
using can::DriveMode;
using can::DrivePhase;
using test::group_config;
using test::Rig;
using Power = simulated_drive::SimulatedDrive::Power;

class Modes : public testing::TestWithParam<DriveMode> {};

TEST_P(Modes, ComesUpWithoutMoving) {
  simulated_drive::DriveOptions options;
  options.motor.start_rad = 0.7;
  Rig rig(group_config(GetParam(), 3), options);
  ASSERT_TRUE(rig.bring_up()) << rig.group->sentence();
  for (const auto& drive : rig.drives) {
    EXPECT_EQ(drive->power(), Power::kEnabled);
    EXPECT_NEAR(drive->motor().joint_rad(), 0.7, 1e-4);
  }
  EXPECT_NEAR(rig.group->report().position[2], 0.7, 1e-4);
}

TEST_P(Modes, PowerGoesOffWhenNotEnabled) {
  Rig rig(group_config(GetParam(), 2));
  ASSERT_TRUE(rig.bring_up());
  rig.command.enable = false;
  rig.run(0.05);
  EXPECT_EQ(rig.state(), DriveGroupState::kReady);
  for (const auto& drive : rig.drives) EXPECT_EQ(drive->power(), Power::kSwitchOnDisabled);
}

TEST_P(Modes, CycleUsesNoHeap) {
  Rig rig(group_config(GetParam(), 3));
  rig.command.enable = true;
  for (int i = 0; i < 3000; ++i) {
    {
      const test::HeapGuard guard;
      rig.group->step(rig.command, rig.bus.now_ns());
    }
    rig.master_frozen = true;
    rig.cycle();
    rig.master_frozen = false;
    if (i == 1500) rig.drives[1]->trip(0x2310);
  }
  EXPECT_EQ(rig.state(), DriveGroupState::kFault);
}

INSTANTIATE_TEST_SUITE_P(All, Modes,
                         testing::Values(DriveMode::kPosition, DriveMode::kVelocity, DriveMode::kTorque));

TEST(Drives, PositionModeFollowsASineWithinAMilliradian) {
  Rig rig(group_config(DriveMode::kPosition, 2));
  ASSERT_TRUE(rig.bring_up());
  double worst = 0.0;
  const auto start_ns = rig.bus.now_ns();
  for (int i = 0; i < 2000; ++i) {
    const double t = core::seconds(rig.bus.now_ns() - start_ns);
    rig.command.position[0] = 0.3 * (1.0 - std::cos(2.0 * t));
    rig.cycle();
    // One period until the target acts, one in which it is reached.
    const double due = 0.3 * (1.0 - std::cos(2.0 * std::max(0.0, t - 0.002)));
    worst = std::max(worst, std::abs(rig.drives[0]->motor().joint_rad() - due));
  }
  EXPECT_LT(worst, 2e-3);
  EXPECT_EQ(rig.state(), DriveGroupState::kEnabled);
}

TEST(Drives, PositionTargetFarAwayIsApproachedAtTheGreatestSpeed) {
  Rig rig(group_config(DriveMode::kPosition, 1));
  ASSERT_TRUE(rig.bring_up());
  rig.command.position[0] = 2.0;
  double furthest_ahead = 0.0;
  for (int i = 0; i < 500; ++i) {
    rig.cycle();
    furthest_ahead = std::max(furthest_ahead, rig.drives[0]->motor().joint_rad() - 1.0 * 0.002 * i);
  }
  EXPECT_LT(furthest_ahead, 0.05);  // max_speed is 1 rad/s; the drive's loops overshoot a little
  EXPECT_NEAR(rig.drives[0]->motor().joint_rad(), 1.0, 0.05);
}

TEST(Drives, PositionStaysInTheJointsRange) {
  Rig rig(group_config(DriveMode::kPosition, 1));
  ASSERT_TRUE(rig.bring_up());
  rig.command.position[0] = 100.0;
  rig.run(4.0);
  EXPECT_NEAR(rig.drives[0]->motor().joint_rad(), 3.0, 2e-3);
}

TEST(Drives, VelocityModeTurnsAtTheCommandedSpeedAndStopsAtTheRange) {
  Rig rig(group_config(DriveMode::kVelocity, 1));
  ASSERT_TRUE(rig.bring_up());
  rig.command.velocity[0] = 0.5;
  rig.run(1.0);
  EXPECT_NEAR(rig.drives[0]->motor().joint_rad_s(), 0.5, 0.01);
  EXPECT_NEAR(rig.group->report().velocity[0], 0.5, 0.01);
  rig.command.velocity[0] = 50.0;
  rig.run(4.0);
  EXPECT_NEAR(rig.drives[0]->motor().joint_rad(), 3.0, 0.02);
}

TEST(Drives, TorqueModeExertsTheCommandedTorqueAtTheJoint) {
  simulated_drive::DriveOptions options;
  options.motor.joint = {.inertia = 0.5, .viscous = 0.0, .coulomb = 0.0};
  auto config = group_config(DriveMode::kTorque, 1);
  config.axes[0].max_speed = 10.0;
  Rig rig(config, options);
  ASSERT_TRUE(rig.bring_up());
  rig.command.torque[0] = 1.0;
  rig.run(0.5);
  EXPECT_NEAR(rig.drives[0]->motor().joint_rad_s(), 1.0 * 0.5 / 0.5, 0.02);  // τ·t/J
  EXPECT_NEAR(rig.group->report().torque[0], 1.0, 0.01);
  rig.command.torque[0] = 100.0;
  rig.run(0.02);
  EXPECT_NEAR(rig.group->report().torque[0], 5.0, 0.01);  // max_torque
}

// Not only the drive's own limit (0x6072): what goes over the bus is within the axis's.
TEST(Drives, NoTargetTorqueBeyondTheAxissLimitIsSent) {
  for (const DriveMode mode : {DriveMode::kTorque, DriveMode::kVelocity, DriveMode::kPosition}) {
    auto config = group_config(mode, 1);
    config.axes[0].max_torque = 2.0;
    Rig rig(config);
    auto listener = rig.bus.connect("listener");
    ASSERT_TRUE(rig.bring_up());
    const std::size_t place = mode == DriveMode::kTorque ? 2 : 6;  // after the controlword, or the target
    const int most_mille = config.axes[0].units.torque_mille(2.0);
    int greatest_mille = 0, sent = 0;
    for (const double torque_Nm : {1e3, -1e300, 4.0, -2.5}) {
      rig.command.torque[0] = torque_Nm;
      rig.run(0.02);
      for (can::Received got; listener->receive(got);) {
        if (!got.is_frame() || got.frame.id != 0x201) continue;
        const auto mille = static_cast<std::int16_t>(got.frame.data[place] | got.frame.data[place + 1] << 8);
        greatest_mille = std::max(greatest_mille, std::abs(static_cast<int>(mille)));
        ++sent;
      }
    }
    EXPECT_GT(sent, 30);
    EXPECT_EQ(greatest_mille, most_mille);
  }
}

TEST(Drives, TurnedMotorsAndOffsetsAreTheConfigurationsBusiness) {
  auto config = group_config(DriveMode::kPosition, 1);
  config.axes[0].units.sign = -1;
  config.axes[0].units.offset = 0.5;
  Rig rig(config);
  ASSERT_TRUE(rig.bring_up());
  EXPECT_NEAR(rig.group->report().position[0], 0.5, 1e-4);
  rig.command.position[0] = 0.8;
  rig.run(1.0);
  EXPECT_NEAR(rig.drives[0]->motor().joint_rad(), -0.3, 1e-3);
}

TEST(Drives, NumbersThatAreNoneMoveNothing) {
  for (const DriveMode mode : {DriveMode::kPosition, DriveMode::kVelocity, DriveMode::kTorque}) {
    Rig rig(group_config(mode, 1));
    ASSERT_TRUE(rig.bring_up());
    rig.command.position[0] = rig.command.velocity[0] = rig.command.torque[0] = std::nan("");
    rig.run(0.5);
    EXPECT_NEAR(rig.drives[0]->motor().joint_rad(), 0.0, 1e-3);
    EXPECT_GT(rig.group->report().refused_values, 0U);
  }
}

TEST(Drives, APositionThatIsNoneIsForgottenOnceThereIsOneAgain) {
  Rig rig(group_config(DriveMode::kPosition, 1));
  ASSERT_TRUE(rig.bring_up());
  rig.command.position[0] = 0.5;
  rig.run(1.5);
  ASSERT_NEAR(rig.drives[0]->motor().joint_rad(), 0.5, 1e-3);
  rig.command.position[0] = std::nan("");
  for (int i = 0; i < 250; ++i) {
    rig.cycle();
    ASSERT_NEAR(rig.drives[0]->motor().joint_rad(), 0.5, 1e-3);
  }
  rig.command.position[0] = 0.6;
  rig.run(1.0);
  EXPECT_NEAR(rig.drives[0]->motor().joint_rad(), 0.6, 1e-3);
}

TEST(Drives, SR05_TheWayToPowerNeverResetsAFault) {
  using can::PowerState;
  for (int state = 0; state <= static_cast<int>(PowerState::kFault); ++state)
    EXPECT_EQ(can::towards_enabled(static_cast<PowerState>(state)) & can::kCommandFaultReset, 0) << state;
  EXPECT_EQ(can::towards_enabled(PowerState::kFault), can::kCommandDisableVoltage);
}

// What a drive has as its target in the moment in which it gets power.
TEST(Drives, ADriveThatDoesNotFollowYetHasWhereItStandsAsItsTargetAndNoTorque) {
  for (const DriveMode mode : {DriveMode::kPosition, DriveMode::kTorque}) {
    simulated_drive::DriveOptions options;
    options.motor.start_rad = 1.0;
    Rig rig(group_config(mode, 1), options);
    rig.command.torque[0] = mode == DriveMode::kTorque ? 3.0 : 0.0;
    int powered = 0;
    rig.on_cycle = [&] {
      if (rig.drive(0).phase == DrivePhase::kEnabled) return;
      const auto& drive = *rig.drives[0];
      EXPECT_EQ(drive.dictionary().value(0x6071), 0);
      if (drive.power() != Power::kEnabled) return;
      ++powered;
      if (mode == DriveMode::kPosition) {
        EXPECT_NEAR(static_cast<double>(drive.dictionary().value(0x607A)),
                    static_cast<double>(drive.motor().counts()), 50.0);
      }
    };
    ASSERT_TRUE(rig.bring_up());
    EXPECT_GT(powered, 0) << "it has power some cycles before it follows";
  }
}

// A position loop that sees no more how the joint moves asks for ever more torque.
TEST(Drives, TorqueStaysWhatItWasWhileADriveDoesNotAnswer) {
  auto config = group_config(DriveMode::kTorque, 1);
  config.timing.most_missed = 100;
  simulated_drive::DriveOptions options;
  options.motor.joint = {.inertia = 0.5, .viscous = 0.0, .coulomb = 0.0};
  Rig rig(config, options);
  ASSERT_TRUE(rig.bring_up());
  rig.command.torque[0] = 1.0;
  rig.run(0.1);
  rig.drives[0]->misbehaviour.mute_pdos = true;
  rig.run(0.01);
  const double before = rig.drives[0]->motor().joint_rad_s();
  rig.command.torque[0] = 5.0;
  rig.run(0.1);
  EXPECT_NEAR(rig.drives[0]->motor().joint_rad_s() - before, 1.0 * 0.1 / 0.5, 0.01);  // τ·t/J
  EXPECT_EQ(rig.state(), DriveGroupState::kEnabled);
  rig.drives[0]->misbehaviour.mute_pdos = false;
  rig.run(0.02);
  EXPECT_NEAR(rig.group->report().torque[0], 5.0, 0.01);
}

TEST(Drives, QuickStopHoldsAgainstAWeightAndLetsGoOn) {
  simulated_drive::DriveOptions options;
  options.motor.load_Nm = 2.0;
  Rig rig(group_config(DriveMode::kVelocity, 1), options);
  ASSERT_TRUE(rig.bring_up());
  rig.command.velocity[0] = 0.8;
  rig.run(0.5);
  rig.command.quick_stop = true;
  rig.run(0.3);
  const double held = rig.drives[0]->motor().joint_rad();
  EXPECT_EQ(rig.state(), DriveGroupState::kQuickStop);
  EXPECT_EQ(rig.drives[0]->power(), Power::kQuickStop) << "it holds by itself, whatever comes next";
  rig.run(1.0);
  EXPECT_NEAR(rig.drives[0]->motor().joint_rad(), held, 1e-3);
  rig.command.quick_stop = false;
  rig.run(0.3);
  EXPECT_EQ(rig.state(), DriveGroupState::kEnabled);
  EXPECT_GT(rig.drives[0]->motor().joint_rad_s(), 0.7);
}

TEST(Drives, MeasurementsMayComeSeldomer) {
  auto config = group_config(DriveMode::kPosition, 1);
  config.timing.measure_every = 10;
  Rig rig(config);
  ASSERT_TRUE(rig.bring_up());
  rig.command.position[0] = 2.0;
  rig.run(0.5);
  EXPECT_NEAR(rig.group->report().velocity[0], 1.0, 0.1) << rig.group->sentence();
}

// Two drives, of which the second one sends its digital inputs: an enabling switch on its terminals.
TEST(Drives, SR19_DigitalInputsComeWithEachSyncAndWithTheTimeOfTheirReceipt) {
  auto config = group_config(DriveMode::kPosition, 2);
  config.axes[1].digital_inputs = true;
  Rig rig(config, {.enabling_inputs = 0x80000001});
  EXPECT_EQ(rig.group->drive(1).inputs_ns, 0) << "nothing was heard yet";
  ASSERT_TRUE(rig.bring_up()) << rig.group->sentence();
  const auto age_s = [&rig] { return core::seconds(rig.bus.now_ns() - rig.group->drive(1).inputs_ns); };
  rig.drives[1]->hold_switch(true);
  rig.run(0.004);
  rig.group->listen();
  EXPECT_EQ(rig.group->drive(1).digital_inputs, 0x80000001U);
  EXPECT_LE(age_s(), config.timing.period_s);
  EXPECT_EQ(rig.group->drive(0).inputs_ns, 0) << "the first one was not asked for them";
  rig.drives[1]->hold_switch(false);
  rig.run(0.004);
  rig.group->listen();
  EXPECT_EQ(rig.group->drive(1).digital_inputs, 0U);
  rig.drives[1]->misbehaviour.mute_inputs = true;
  rig.run(0.5);
  EXPECT_NEAR(age_s(), 0.5, 0.005) << "they grow old";
  EXPECT_EQ(rig.state(), can::DriveGroupState::kEnabled) << "which is no fault of the drive";
  rig.drives[1]->misbehaviour.mute_inputs = false;
  rig.drives[1]->power_cycle();
  rig.run(0.1);
  rig.reset();
  EXPECT_TRUE(rig.bring_up()) << rig.group->sentence();
  EXPECT_LE(age_s(), 2 * config.timing.period_s) << "set up again after it has booted";
}

// On a real bus the answers of one cycle must be there before the next: the bus paces at 1 Mbit/s here.
TEST(Drives, SixDrivesFitAtFiveHundredHertzWithOneMeasurementInFive) {
  auto config = group_config(DriveMode::kTorque, 6);
  config.timing.measure_every = 5;
  ASSERT_TRUE(can::check(config)) << can::check(config).message();
  Rig rig(config);
  ASSERT_TRUE(rig.bring_up()) << rig.group->sentence();
  const auto missed = rig.drive(5).missed;
  rig.run(2.0);
  EXPECT_EQ(rig.state(), DriveGroupState::kEnabled);
  EXPECT_EQ(rig.drive(5).missed, missed);
  EXPECT_EQ(rig.group->report().not_sent, 0U);
}

TEST(Drives, SR12_RandomFramesNeverMoveAnArm) {
  for (const bool enabled : {false, true}) {
    auto config = group_config(DriveMode::kPosition, 2);
    Rig rig(config);
    if (enabled) {
      ASSERT_TRUE(rig.bring_up());
    }
    auto intruder = rig.bus.connect("intruder");
    std::mt19937 random(7);
    rig.on_cycle = [&] {
      can::CanFrame frame;
      // Anything towards the master: all but what would command the drives.
      const std::uint32_t to_master[] = {0x080, 0x180, 0x280, 0x380, 0x580, 0x700};
      const std::uint32_t node = 1 + random() % 2;
      frame.id = to_master[random() % 6] + node;
      frame.length = static_cast<std::uint8_t>(random() % 9);
      for (int i = 0; i < frame.length; ++i)
        frame.data[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(random());
      intruder->send(frame);
      if (random() % 50 == 0) rig.command.reset = !rig.command.reset;
    };
    rig.run(20.0);
    for (const auto& drive : rig.drives) EXPECT_NEAR(drive->motor().joint_rad(), 0.0, 1e-3);
  }
}

TEST(Drives, RandomFramesNeverBreakTheSimulatedDrive) {
  Rig rig(group_config(DriveMode::kPosition, 1));
  auto intruder = rig.bus.connect("intruder");
  std::mt19937 random(3);
  rig.on_cycle = [&] {
    for (int n = 0; n < 3; ++n) {
      can::CanFrame frame;
      frame.id = random() % 2 ? 0x601 : random() % 0x800;
      frame.length = static_cast<std::uint8_t>(random() % 9);
      for (int i = 0; i < frame.length; ++i)
        frame.data[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(random());
      intruder->send(frame);
    }
  };
  rig.run(20.0);
  EXPECT_TRUE(std::isfinite(rig.drives[0]->motor().joint_rad()));
}

}  // namespace
}  // namespace phantom::drive_test
