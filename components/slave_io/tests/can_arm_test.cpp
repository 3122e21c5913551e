// The servo with drives on a bus in this process, on a clock of the test's own: repeats exactly.
#include "components/slave_io/can_arm.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "components/slave_io/tests/arm_bench.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::slave_io {
namespace {

using can::DriveMode;
using teleop::LinkState;
using testing::HasSubstr;
constexpr std::size_t kBusJoints = 7;

using Bench = ArmBench;

// Tries slave_io: drives not there yet
TEST(CanArm, SaysNothingBeforeItsEncodersDoAndCouplesOnlyOnceTheDrivesFollow) {
  Bench bench;
  bench.tick();
  EXPECT_EQ(bench.published, 0) << "where the arm is was not known yet";
  EXPECT_FALSE(bench.arm->health().follows);
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
  EXPECT_TRUE(bench.arm->health().follows);
  EXPECT_EQ(bench.arm->health().message, "");
  for (std::size_t j = 0; j < kBusJoints; ++j) EXPECT_NEAR(bench.joint(j), shipped_arm().home[j], 1e-3) << j;
  EXPECT_LT(bench.fastest, 0.02) << "nothing jumped when the power came on";
}

class EachMode : public testing::TestWithParam<DriveMode> {};

TEST_P(EachMode, EveryJointFollowsTheMasterAndTheLoopsTorqueIsTold) {
  Bench bench(can_config(GetParam()));
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
  const double dt = bench.config.period_s;
  double most_Nm = 0.0;
  for (double t = 0; t < 1.0; t += dt) {
    for (std::size_t j = 0; j < kBusJoints; ++j) {
      const double away = shipped_arm().home[j] > 0.0 ? -1.0 : 1.0;
      bench.master.velocity[j] = j == 0 ? 0.1 : 0.3 * away;
      bench.master.position[j] += bench.master.velocity[j] * dt;
    }
    bench.tick();
    most_Nm = std::max(most_Nm, std::abs(bench.last.loop_torque_Nm[3]));
  }
  bench.master.velocity = {};
  bench.run(1.0);
  ASSERT_EQ(bench.state(), LinkState::kCoupled);
  for (std::size_t j = 0; j < kBusJoints; ++j) {
    EXPECT_NEAR(bench.joint(j), bench.master.position[j], 2e-3) << j;
    EXPECT_NEAR(bench.last.position[j], bench.joint(j), 1e-4) << j;
  }
  EXPECT_GT(most_Nm, 0.3) << "the joint's friction and inertia";
  EXPECT_LT(bench.fastest, 1.0);
}

INSTANTIATE_TEST_SUITE_P(Modes, EachMode,
                         testing::Values(DriveMode::kTorque, DriveMode::kVelocity, DriveMode::kPosition));

// In the time that the drives take to miss the heartbeat, the last torque would go on unchecked.
// Tries slave_io: slave_io ends in order
TEST(CanArm, WhenSlaveIoEndsTheDrivesHoldOrCoastAtOnce) {
  using Power = simulated_drive::SimulatedDrive::Power;
  for (const auto reaction : {can::FaultReaction::kHold, can::FaultReaction::kCoast}) {
    for (const DriveMode mode : {DriveMode::kTorque, DriveMode::kVelocity, DriveMode::kPosition}) {
      Bench bench(can_config(mode, reaction));
      ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
      bench.master.velocity[3] = 0.3;
      for (int i = 0; i < 100; ++i) {
        bench.master.position[3] += 0.3 * bench.config.period_s;
        bench.tick();
      }
      ASSERT_GT(bench.speed(3), 0.1);
      bench.arm->end(bench.now_ns += bench.period_ns);
      for (int i = 0; i < 4; ++i, bench.now_ns += bench.period_ns)
        bench.rig.pass(bench.now_ns + bench.period_ns, bench.period_ns);
      ASSERT_LT(4 * bench.config.period_s, bench.config.can->group.timing.heartbeat_timeout_s / 2);
      const Power wanted =
          reaction == can::FaultReaction::kHold ? Power::kQuickStop : Power::kSwitchOnDisabled;
      for (const auto& drive : bench.drives) EXPECT_EQ(drive->power(), wanted);
    }
  }
}

TEST(CanArm, WhatItCannotKnowIsToldAsUnknown) {
  Config without = can_config();
  without.force_sensor = false;
  Bench bench(without);
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled));
  EXPECT_FALSE(bench.last.contact);
  EXPECT_EQ(bench.last.contact_force_N, -1.0);
  EXPECT_EQ(bench.last.clearance_m, -1.0);
  EXPECT_FALSE(bench.last.force_measured);
}

// A drive dies while the arm moves: all stop, nothing jumps, nothing goes on before a reset, and then from an
// aligned pose.
// Tries slave_io: a drive in fault
TEST(CanArm, AFaultStopsTheArmUntilAResetAndPosesAreAlignedAnew) {
  for (const auto reaction : {can::FaultReaction::kHold, can::FaultReaction::kCoast}) {
    Bench bench(can_config(DriveMode::kTorque, reaction));
    ASSERT_TRUE(bench.reaches(LinkState::kCoupled));
    const double dt = bench.config.period_s;
    for (double t = 0; t < 0.5; t += dt) {
      bench.master.velocity[3] = 0.4;
      bench.master.position[3] += 0.4 * dt;
      bench.tick();
    }
    bench.drives[3]->trip(0x2310);
    bench.fastest = 0.0;
    bench.master.velocity = {};
    ASSERT_TRUE(bench.reaches(LinkState::kStopped, 0.05));
    const core::ActuatorHealth health = bench.arm->health();
    EXPECT_TRUE(health.fault);
    EXPECT_THAT(health.message, HasSubstr("j4_elbow is in fault"));
    EXPECT_EQ(bench.last.outputs.stop.cause, teleop::StopCause::kDriveFault);
    EXPECT_THAT(health.message, HasSubstr(reaction == can::FaultReaction::kHold ? "hold" : "coast"));
    bench.run(3.0);
    EXPECT_EQ(bench.state(), LinkState::kStopped) << "stays until a reset";
    EXPECT_LT(bench.fastest, 0.5) << "it was at a third of its speed";
    EXPECT_EQ(bench.last.loop_torque_Nm[3], 0.0);
    EXPECT_LT(std::abs(bench.speed(3)), 1e-3);
    const bool powered = reaction == can::FaultReaction::kHold;
    EXPECT_EQ(bench.drives[0]->power() == simulated_drive::SimulatedDrive::Power::kQuickStop, powered);
    // The master went on meanwhile: the arm comes to it slowly, and is not coupled before.
    bench.master.position[3] += 0.2;
    bench.master.state = LinkState::kReady;
    bench.fastest = 0.0;
    bench.reset();
    ASSERT_TRUE(bench.reaches(LinkState::kAligned)) << bench.arm->health().message;
    EXPECT_LT(bench.fastest, 0.3) << "the alignment's speed, not a jump";
    bench.master.state = LinkState::kCoupled;
    EXPECT_TRUE(bench.reaches(LinkState::kCoupled));
    EXPECT_FALSE(bench.arm->health().fault);
  }
}

// Tries slave_io: silent or frozen
TEST(CanArm, ADriveThatFallsSilentIsNamedAndComesBackAfterAReset) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled));
  bench.frozen[5] = true;
  ASSERT_TRUE(bench.reaches(LinkState::kStopped, 0.1));
  EXPECT_THAT(bench.arm->health().message, HasSubstr("j6_wrist leaves SYNCs without an answer"));
  bench.reset();
  bench.run(1.0);
  EXPECT_NE(bench.state(), LinkState::kCoupled) << "it is still silent";
  bench.frozen[5] = false;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
}

TEST(CanArm, NoDriveHasPowerBeforeTheMasterIsHeard) {
  Bench bench;
  bench.heard = false;
  for (double t = 0; t < 3.0; t += bench.config.period_s) {
    bench.tick();
    for (const auto& drive : bench.drives)
      ASSERT_NE(drive->power(), simulated_drive::SimulatedDrive::Power::kEnabled);
  }
  bench.heard = true;
  EXPECT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
}

// Also of drives that coast at a fault.
TEST(CanArm, AnEmergencyStopIsTheDrivesQuickStopWhateverTheyDoAtAFault) {
  for (const auto reaction : {can::FaultReaction::kHold, can::FaultReaction::kCoast}) {
    Bench bench(can_config(DriveMode::kTorque, reaction));
    ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
    bench.inbox.stops.stop();
    bench.run(0.1);
    EXPECT_EQ(bench.state(), LinkState::kStopped);
    for (const auto& drive : bench.drives)
      EXPECT_EQ(drive->power(), simulated_drive::SimulatedDrive::Power::kQuickStop);
  }
}

TEST(CanArm, AnEmergencyStopHoldsUntilAReset) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled));
  bench.inbox.stops.stop();
  bench.run(0.1);
  EXPECT_EQ(bench.state(), LinkState::kStopped);
  EXPECT_EQ(bench.last.outputs.stop.cause, teleop::StopCause::kEmergency);
  EXPECT_FALSE(bench.arm->health().fault);
  bench.master.position[4] += 0.2;
  bench.run(1.0);
  EXPECT_NEAR(bench.joint(4), shipped_arm().home[4], 1e-3);
  bench.master.position[4] -= 0.2;
  bench.fastest = 0.0;
  bench.reset();
  EXPECT_TRUE(bench.reaches(LinkState::kCoupled));
  EXPECT_LT(bench.fastest, 0.05);
}

// An encoder whose offset is wrong: with power on, the arm would be driven through half the cell.
// Tries slave_io: a joint outside its range
TEST(CanArm, AJointOutsideItsRangeKeepsThePowerOff) {
  auto start = shipped_arm().home;
  start[2] = 2.5;
  Bench bench(can_config(), start);
  bench.run(3.0);
  EXPECT_EQ(bench.state(), LinkState::kInit);
  EXPECT_THAT(bench.arm->health().message, HasSubstr("j3_shoulder stands at 2.5, outside its range of"));
  EXPECT_NE(bench.drives[0]->power(), simulated_drive::SimulatedDrive::Power::kEnabled);
  EXPECT_NEAR(bench.joint(2), 2.5, 1e-9);
}

TEST(CanArm, MasterValuesThatAreNoneMoveNothing) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled));
  bench.fastest = 0.0;
  bench.master.position[2] = std::nan("");
  bench.master.velocity[3] = std::numeric_limits<double>::infinity();
  bench.run(0.5);
  EXPECT_LT(bench.fastest, 0.01);
  EXPECT_EQ(bench.arm->drives().refused_values, 0U) << "none got as far as the drives";
}

TEST(CanArm, TheTickUsesNoHeap) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled));
  for (int i = 0; i < 1000; ++i) {
    bench.now_ns += bench.period_ns;
    bench.master.position[3] += 0.0003;
    bench.master.received_ns = bench.now_ns;
    bench.inbox.master.write(bench.master);
    {
      const test::HeapGuard guard;  // the drives and the bus of the test may use it
      bench.servo->tick(bench.config.period_s, bench.now_ns);
    }
    bench.rig.pass(bench.now_ns + bench.period_ns, bench.period_ns);
    if (i == 500) bench.drives[1]->trip(0x2310);
  }
  bench.servo->outbox.read(bench.last);
  EXPECT_EQ(bench.state(), LinkState::kStopped);
}

// One joint whose encoder is not absolute; its home is where it stands.
Config with_homing() {
  Config config = can_config();
  can::AxisConfig& axis = config.can->group.axes[2];
  axis.homing = can::HomingConfig{.method = 35, .search_speed = 0.1, .zero_speed = 0.02, .acceleration = 0.5};
  axis.units.offset = shipped_arm().home[2];
  return config;
}

// Tries slave_io: a joint has to be homed
TEST(CanArm, AnArmThatHasToBeHomedStandsStillUntilAPersonAsks) {
  Bench bench(with_homing());
  EXPECT_THAT(bench.inbox.homing.ask().message(), HasSubstr("no drive has to be homed"));
  bench.tick();
  EXPECT_THAT(bench.inbox.homing.ask().message(), HasSubstr("not ready yet"));
  bench.run(3.0);
  EXPECT_FALSE(bench.arm->health().follows);
  EXPECT_FALSE(bench.arm->health().fault);
  EXPECT_EQ(bench.arm->health().message, "to be homed, as their encoders are not absolute: j3_shoulder");
  EXPECT_EQ(bench.published, 0) << "no position is known";
  for (const auto& drive : bench.drives)
    EXPECT_EQ(drive->power(), simulated_drive::SimulatedDrive::Power::kSwitchOnDisabled);
  EXPECT_TRUE(bench.inbox.homing.ask());
  EXPECT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
  EXPECT_NEAR(bench.joint(2), shipped_arm().home[2], 1e-3);
  EXPECT_THAT(bench.inbox.homing.ask().message(), HasSubstr("no drive has to be homed"));
}

TEST(CanArm, SR04_NoDriveIsHomedDuringAStop) {
  Bench bench(with_homing());
  bench.run(2.0);
  EXPECT_TRUE(bench.inbox.homing.ask());
  bench.inbox.stops.stop();  // in the same tick
  bench.run(1.0);
  for (const auto& drive : bench.drives)
    EXPECT_NE(drive->power(), simulated_drive::SimulatedDrive::Power::kEnabled);
  EXPECT_THAT(bench.inbox.homing.ask().message(), HasSubstr("the arm is stopped; allowed: after a reset"));
  bench.reset();
  bench.run(0.5);
  EXPECT_THAT(bench.arm->health().message, HasSubstr("to be homed")) << "it was asked for before the stop";
  EXPECT_TRUE(bench.inbox.homing.ask());
  EXPECT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
}

// Homing is motion that nobody's hand leads.
TEST(CanArm, SR19_DrivesAreHomedOnlyWhileTheEnablingSwitchIsHeld) {
  Config config = with_homing();
  config.can->group.axes[2].homing->method = 19;  // to a home switch that is a radian away
  Bench bench(config, shipped_arm().home, [](std::size_t j, simulated_drive::DriveOptions& o) {
    if (j != 2) return;
    o.switches.home_from = o.motor.counts_per_rad() * (o.motor.start_rad + 1.0);
    o.switches.home_to = o.motor.counts_per_rad() * (o.motor.start_rad + 1.2);
  });
  bench.master.motion_permitted = false;
  bench.run(3.0);
  EXPECT_THAT(bench.inbox.homing.ask().message(),
              HasSubstr("an enabling switch is released; allowed: while"));
  bench.master.motion_permitted = true;
  bench.run(0.1);
  EXPECT_TRUE(bench.inbox.homing.ask());
  bench.run(2.0);
  ASSERT_GT(std::abs(bench.speed(2)), 0.05) << bench.arm->health().message;
  bench.master.motion_permitted = false;
  bench.run(0.1);
  const double where = bench.joint(2);
  EXPECT_NEAR(bench.speed(2), 0.0, 1e-3);
  bench.run(2.0);
  bench.master.motion_permitted = true;
  bench.run(2.0);
  EXPECT_NEAR(bench.joint(2), where, 1e-3) << "only a new request goes on";
  EXPECT_THAT(bench.arm->health().message, HasSubstr("to be homed"));
  EXPECT_TRUE(bench.inbox.homing.ask());
  bench.run(2.0);
  EXPECT_GT(std::abs(bench.joint(2) - where), 0.05);
}

}  // namespace
}  // namespace phantom::slave_io
