// Holding brakes that drives open and close by themselves, under a weight: the order of brake, torque and
// targets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/can/rig.hpp"

namespace phantom::brake_test {
namespace {

using can::DriveFault;
using can::DriveGroupState;
using can::DriveMode;
using can::DrivePhase;
using can::FaultReaction;
using test::Rig;
using testing::HasSubstr;
using Power = simulated_drive::SimulatedDrive::Power;

constexpr double kRelease_s = 0.12, kEngage_s = 0.05;  // as configured; the brake itself takes 0.05 s each
constexpr double kMaxSag_rad = 0.00175;                // a tenth of a degree
constexpr double kStart_rad = 0.4;

simulated_drive::DriveOptions braked(double load_Nm) {
  simulated_drive::DriveOptions options;
  options.motor.load_Nm = load_Nm;
  options.motor.start_rad = kStart_rad;
  options.motor.brake = {.holds_Nm = 20.0, .release_s = 0.05, .engage_s = 0.05};
  return options;
}

can::DriveGroupConfig with_brake(DriveMode mode, int drives = 1,
                                 FaultReaction reaction = FaultReaction::kHold) {
  auto config = test::group_config(mode, drives, reaction);
  for (auto& axis : config.axes)
    axis.brake = can::BrakeConfig{.release_s = kRelease_s, .engage_s = kEngage_s};
  return config;
}

/// Brings the drives up with the torque that holds the weight, and where they stand as their target.
bool hold_up(Rig& rig, double load_Nm) {
  rig.command.torque.fill(-load_Nm);
  rig.command.position.fill(kStart_rad);
  return rig.bring_up();
}

/// The farthest that any joint gets from where it began, within `seconds`.
double farthest_rad(Rig& rig, double from_rad, double seconds) {
  double farthest = 0.0;
  for (const auto until = rig.bus.now_ns() + core::from_seconds(seconds); rig.bus.now_ns() < until;) {
    rig.cycle();
    for (const auto& drive : rig.drives)
      farthest = std::max(farthest, std::abs(drive->motor().joint_rad() - from_rad));
  }
  return farthest;
}

struct Ending {
  const char* name;
  void (*begin)(Rig&);
};
const Ending kEndings[] = {
    {"power withdrawn", [](Rig& r) { r.command.enable = false; }},
    {"power withdrawn, to hold", [](Rig& r) { r.command = {.hold = true}; }},
    {"stop", [](Rig& r) { r.command = {.quick_stop = true}; }},
    {"fault of the drive", [](Rig& r) { r.drives[0]->trip(0x2310); }},
    {"fault of another drive", [](Rig& r) { r.drives[1]->trip(0x2310); }},
    {"master gone", [](Rig& r) { r.master_frozen = true; }},
};

struct Case {
  DriveMode mode;
  FaultReaction reaction;
};
class Brakes : public testing::TestWithParam<Case> {};
INSTANTIATE_TEST_SUITE_P(Each, Brakes,
                         testing::Values(Case{DriveMode::kPosition, FaultReaction::kHold},
                                         Case{DriveMode::kVelocity, FaultReaction::kHold},
                                         Case{DriveMode::kTorque, FaultReaction::kHold},
                                         Case{DriveMode::kPosition, FaultReaction::kCoast},
                                         Case{DriveMode::kTorque, FaultReaction::kCoast}));

// In whichever way power ends, the weight stays up: the brake holds before the torque is gone.
TEST_P(Brakes, SR04_NoWeightSagsWhenPowerComesOrGoes) {
  for (const double load_Nm : {3.0, -3.0, 1.0, 0.0}) {
    for (const Ending& ending : kEndings) {
      SCOPED_TRACE(std::string(ending.name) + " under " + std::to_string(load_Nm) + " N·m");
      Rig rig(with_brake(GetParam().mode, 2, GetParam().reaction), braked(load_Nm));
      ASSERT_TRUE(hold_up(rig, load_Nm));
      EXPECT_LT(farthest_rad(rig, kStart_rad, 0.3), kMaxSag_rad) << "coming up";
      const double from_rad = rig.drives[0]->motor().joint_rad();
      ending.begin(rig);
      EXPECT_LT(farthest_rad(rig, from_rad, 1.0), kMaxSag_rad);
      for (const auto& drive : rig.drives) {
        EXPECT_TRUE(drive->power() == Power::kSwitchOnDisabled || drive->power() == Power::kFault);
        EXPECT_EQ(drive->torque_mille(), 0.0);
        EXPECT_TRUE(drive->motor().brake_is_closed());
      }
    }
  }
}

// What the order is worth: the same drive, whose master knows of no brake and takes the voltage away.
TEST(Brake, WithoutTheOrderTheWeightSagsUntilTheBrakeHolds) {
  auto config = with_brake(DriveMode::kPosition);
  config.axes[0].brake.reset();
  Rig rig(config, braked(3.0));
  ASSERT_TRUE(hold_up(rig, 3.0));
  rig.run(0.3);
  const double from_rad = rig.drives[0]->motor().joint_rad();
  rig.command.enable = false;
  EXPECT_GT(farthest_rad(rig, from_rad, 1.0), 3.0 * kMaxSag_rad);
}

// A power stage that loses its supply can keep no order: the weight falls while the spring closes the brake,
// ½ (τ/J) t² and the way to rest.
TEST(Brake, AWeightWhosePowerStageFailsFallsOnlyUntilTheSpringHasClosedIt) {
  Rig rig(with_brake(DriveMode::kTorque), braked(3.0));
  ASSERT_TRUE(hold_up(rig, 3.0));
  const double from_rad = rig.drives[0]->motor().joint_rad();
  rig.drives[0]->cut_power();
  const double fell_rad = farthest_rad(rig, from_rad, 1.0);
  EXPECT_GT(fell_rad, 0.5 * (3.0 / 0.5) * 0.05 * 0.05 * 0.8);
  EXPECT_LT(fell_rad, 0.010);
  EXPECT_EQ(rig.drive(0).fault, DriveFault::kLeftEnabled);
}

TEST_P(Brakes, NothingIsFollowedBeforeTheBrakeHasHadItsTime) {
  Rig rig(with_brake(GetParam().mode, 1, GetParam().reaction), braked(0.0));
  rig.command.enable = true;
  ASSERT_GE(rig.run_until([&] { return rig.drives[0]->power() == Power::kEnabled; }, 3.0), 0.0);
  rig.command.position[0] = 1.5;
  rig.command.velocity[0] = 0.8;
  const double took_ms = rig.run_until(
      [&] {
        EXPECT_NEAR(rig.drives[0]->motor().joint_rad(), kStart_rad, 1e-4);
        return rig.state() == DriveGroupState::kEnabled;
      },
      1.0);
  EXPECT_NEAR(took_ms, 1e3 * kRelease_s, 8.0);
  if (GetParam().mode == DriveMode::kTorque) return;
  rig.run(0.5);
  EXPECT_GT(rig.drives[0]->motor().joint_rad(), kStart_rad + 0.2);
}

// Power that is asked for again while the brake closes: it closes, power ends, and then it comes up as ever.
TEST_P(Brakes, ComesUpAgainHoweverSoonAfterAStop) {
  for (const double pause_s : {0.002, 0.01, 0.03, 0.06, 0.3}) {
    SCOPED_TRACE(pause_s);
    Rig rig(with_brake(GetParam().mode, 2, GetParam().reaction), braked(2.0));
    ASSERT_TRUE(hold_up(rig, 2.0));
    rig.command.quick_stop = true;
    rig.run(pause_s);
    rig.command.quick_stop = false;
    double farthest = farthest_rad(rig, kStart_rad, 1.0);
    EXPECT_EQ(rig.state(), DriveGroupState::kEnabled) << rig.group->sentence();
    EXPECT_LT(farthest, 2.0 * kMaxSag_rad);
  }
}

// ---- a brake that does not open

// Tries slave_io: a brake that does not open
TEST(Brake, OneThatDoesNotOpenIsNamedAfterTheFollowingError) {
  auto config = with_brake(DriveMode::kPosition);
  config.axes[0].following_window = 0.05;
  Rig rig(config, braked(0.0));
  rig.drives[0]->misbehaviour.keep_brake = true;
  rig.command.position[0] = kStart_rad;
  ASSERT_TRUE(rig.bring_up());
  rig.command.position[0] = 1.5;
  ASSERT_GE(rig.run_until([&] { return rig.state() == DriveGroupState::kFault; }, 1.0), 0.0);
  EXPECT_EQ(rig.drive(0).emergency_code, 0x8611);
  EXPECT_THAT(rig.group->sentence(),
              HasSubstr("j1 is in fault: following error (0x8611); it has not moved since it got "
                        "power: its brake may be closed"));
}

// Tries slave_io: a brake that does not open
TEST(Brake, OneThatDoesNotOpenIsNamedByTheTorqueThatMovesNothing) {
  for (const DriveMode mode : {DriveMode::kVelocity, DriveMode::kTorque}) {
    auto options = braked(0.0);
    options.following_window_rad = 100.0;  // it watches no following error
    Rig rig(with_brake(mode), options);
    rig.drives[0]->misbehaviour.keep_brake = true;
    ASSERT_TRUE(rig.bring_up());
    rig.command.velocity[0] = 0.8;
    rig.command.torque[0] = mode == DriveMode::kTorque ? 5.0 : 0.0;
    ASSERT_GE(rig.run_until([&] { return rig.state() == DriveGroupState::kFault; }, 2.0), 0.0);
    EXPECT_EQ(rig.drive(0).fault, DriveFault::kBrakeClosed);
    EXPECT_THAT(rig.group->sentence(), HasSubstr("j1 has not moved under its full torque"));
    rig.drives[0]->misbehaviour.keep_brake = false;
    rig.command.velocity[0] = rig.command.torque[0] = 0.0;
    rig.reset();
    EXPECT_TRUE(rig.bring_up()) << rig.group->sentence();
  }
}

// Who has moved and is held fast then touches something; and without a brake there is none to name.
TEST(Brake, AJointThatIsHeldFastByWhatItTouchesIsNoFault) {
  for (const bool has_brake : {true, false}) {
    auto options = braked(0.0);
    // Also what is stiff yields by some counts: 0.5 mrad under the greatest torque.
    options.motor.wall = {.at_rad = kStart_rad + (has_brake ? 0.1 : 1e-4),
                          .stiffness_Nm_per_rad = 1e4,
                          .damping_Nms_per_rad = 50.0};
    auto config = with_brake(DriveMode::kTorque);
    if (!has_brake) config.axes[0].brake.reset();
    Rig rig(config, options);
    ASSERT_TRUE(rig.bring_up());
    rig.command.torque[0] = 5.0;
    rig.run(3.0);
    EXPECT_EQ(rig.state(), DriveGroupState::kEnabled) << rig.group->sentence();
  }
}

TEST(Brake, DelaysOutOfRangeAreRefused) {
  auto config = with_brake(DriveMode::kTorque);
  config.axes[0].brake->engage_s = -1.0;
  EXPECT_THAT(can::check(config).message(), HasSubstr("j1.brake: -1; allowed: 0 to 10 s"));
}

}  // namespace
}  // namespace phantom::brake_test
