// Drives whose encoders are not absolute: nothing moves before a person has had them homed, and what ends
// that.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/can/rig.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::homing_test {
namespace {

using can::DriveFault;
using can::DriveGroupState;
using can::DriveMode;
using can::DrivePhase;
using test::Rig;
using testing::HasSubstr;
using Power = simulated_drive::SimulatedDrive::Power;

constexpr double kLowerSwitch_rad = -1.0, kUpperSwitch_rad = 1.2, kHomeFrom_rad = 0.3, kHomeTo_rad = 0.5;
constexpr double kIndex_rad = 0.1, kTurn_rad = 6.283185307179586 / test::kGear;

simulated_drive::DriveOptions incremental(double start_rad) {
  simulated_drive::DriveOptions options;
  options.motor.start_rad = start_rad;
  options.incremental = true;
  options.switches = {.lower_limit = kLowerSwitch_rad * test::kCountsPerRad,
                      .upper_limit = kUpperSwitch_rad * test::kCountsPerRad,
                      .home_from = kHomeFrom_rad * test::kCountsPerRad,
                      .home_to = kHomeTo_rad * test::kCountsPerRad,
                      .index = kIndex_rad * test::kCountsPerRad};
  return options;
}

can::DriveGroupConfig with_homing(int method, int drives = 1, DriveMode mode = DriveMode::kPosition) {
  auto config = test::group_config(mode, drives);
  for (auto& axis : config.axes) {
    axis.homing = can::HomingConfig{
        .method = method, .search_speed = 0.5, .zero_speed = 0.05, .acceleration = 5.0, .timeout_s = 60.0};
    axis.units.offset = 0.25;
  }
  return config;
}

bool waits(Rig& rig) {
  return rig.run_until([&] { return rig.group->report().needs_homing; }, 3.0) >= 0.0;
}
void ask(Rig& rig) {
  rig.command = {.hold = true, .home = true};
  rig.cycle();
  rig.command.home = false;
}
bool is_homed(Rig& rig, double most_s = 40.0) {
  return rig.run_until(
             [&] {
               return rig.state() == DriveGroupState::kReady || rig.state() == DriveGroupState::kQuickStop;
             },
             most_s) >= 0.0;
}

// Where each method's home is, by the standard's figures and not by the simulated drive's code.
struct Method {
  int number;
  double home_rad;
};
class Methods : public testing::TestWithParam<Method> {};
INSTANTIATE_TEST_SUITE_P(Each, Methods,
                         testing::Values(Method{17, kLowerSwitch_rad}, Method{18, kUpperSwitch_rad},
                                         Method{19, kHomeFrom_rad}, Method{20, kHomeFrom_rad},
                                         Method{21, kHomeTo_rad}, Method{22, kHomeTo_rad}, Method{33, NAN},
                                         Method{34, NAN}, Method{35, NAN}, Method{37, NAN}));

TEST_P(Methods, FindsItsHomeFromWhereverTheJointStands) {
  for (const double start_rad : {-0.6, 0.0, 0.4}) {
    SCOPED_TRACE(start_rad);
    const int method = GetParam().number;
    Rig rig(with_homing(method), incremental(start_rad));
    ASSERT_TRUE(waits(rig));
    ask(rig);
    double home_rad = GetParam().home_rad;
    if (method == 33) home_rad = kIndex_rad + kTurn_rad * std::floor((start_rad - kIndex_rad) / kTurn_rad);
    if (method == 34) home_rad = kIndex_rad + kTurn_rad * std::ceil((start_rad - kIndex_rad) / kTurn_rad);
    if (method == 35 || method == 37) home_rad = start_rad;
    if (home_rad < kLowerSwitch_rad || home_rad > kUpperSwitch_rad)
      continue;  // the next pulse is beyond a limit
    // 20 and 22 look for an edge that this start may be on the far side of: there is no home before the
    // switch.
    const bool on_this_side = (method != 19 && method != 20 && method != 21 && method != 22) ||
                              (method == 19 && start_rad < kHomeTo_rad) ||
                              (method == 20 && start_rad < kHomeTo_rad) ||
                              ((method == 21 || method == 22) && start_rad > kHomeFrom_rad);
    if (!on_this_side) continue;
    ASSERT_TRUE(is_homed(rig)) << rig.group->sentence();
    rig.run(0.1);
    const double true_rad = rig.drives[0]->motor().joint_rad();
    EXPECT_NEAR(rig.group->report().position[0], true_rad - home_rad + 0.25, 2e-4)
        << "the offset is that of home";
    EXPECT_TRUE(rig.group->report().has_positions);
    EXPECT_TRUE(rig.bring_up()) << rig.group->sentence();
  }
}

TEST(Homing, NothingMovesAndNoPositionIsKnownBeforeSomebodyAsks) {
  Rig rig(with_homing(17, 2), incremental(0.2));
  rig.command.enable = true;
  rig.command.position.fill(1.0);
  ASSERT_TRUE(waits(rig));
  rig.run(2.0);
  EXPECT_FALSE(rig.group->report().has_positions);
  EXPECT_EQ(rig.state(), DriveGroupState::kStarting);
  EXPECT_EQ(rig.group->sentence(), "to be homed, as their encoders are not absolute: j1, j2");
  for (const auto& drive : rig.drives) {
    EXPECT_EQ(drive->power(), Power::kSwitchOnDisabled);
    EXPECT_EQ(drive->motor().joint_rad(), 0.2);
  }
}

TEST(Homing, TakesOneJointAfterTheOther) {
  Rig rig(with_homing(19, 3), incremental(0.0));
  ASSERT_TRUE(waits(rig));
  ask(rig);
  int most = 0;
  ASSERT_GE(rig.run_until(
                [&] {
                  int moving = 0;
                  for (const auto& drive : rig.drives)
                    moving += std::abs(drive->motor().joint_rad_s()) > 5e-3 ? 1 : 0;
                  most = std::max(most, moving);
                  return rig.group->report().has_positions;
                },
                30.0),
            0.0);
  EXPECT_EQ(most, 1);
}

TEST(Homing, SR04_AnyStopEndsItAndItBeginsOnlyWhenSomebodyAsksAgain) {
  Rig rig(with_homing(17, 2), incremental(0.5));
  ASSERT_TRUE(waits(rig));
  ask(rig);
  rig.run(1.0);
  ASSERT_LT(rig.drives[0]->motor().joint_rad_s(), -0.3);
  EXPECT_THAT(rig.group->sentence(), HasSubstr("j1 is homing"));
  rig.command.quick_stop = true;
  rig.run(0.2);
  EXPECT_NEAR(rig.drives[0]->motor().joint_rad_s(), 0.0, 1e-3);
  const double stands_rad = rig.drives[0]->motor().joint_rad();
  rig.command.home = true;  // not while it is stopped
  rig.run(0.5);
  rig.command = {.hold = true};
  rig.run(2.0);
  EXPECT_NEAR(rig.drives[0]->motor().joint_rad(), stands_rad, 1e-3);
  EXPECT_FALSE(rig.group->report().has_positions);
  ask(rig);
  EXPECT_TRUE(is_homed(rig));
}

TEST(Homing, AFaultOfAnotherDriveEndsIt) {
  Rig rig(with_homing(17, 2), incremental(0.5));
  ASSERT_TRUE(waits(rig));
  ask(rig);
  rig.run(0.5);
  rig.drives[1]->trip(0x2310);
  rig.run(0.3);
  EXPECT_EQ(rig.state(), DriveGroupState::kFault);
  EXPECT_NEAR(rig.drives[0]->motor().joint_rad_s(), 0.0, 1e-3);
}

// Tries slave_io: a drive finds no home; not in time
TEST(Homing, WhatFindsNoHomeIsAFaultThatSaysSo) {
  auto options = incremental(0.0);
  options.switches.home_to = options.switches.home_from;  // its home switch is broken: it comes to the limit
  Rig rig(with_homing(19), options);
  ASSERT_TRUE(waits(rig));
  ask(rig);
  ASSERT_GE(rig.run_until([&] { return rig.state() == DriveGroupState::kFault; }, 20.0), 0.0);
  EXPECT_EQ(rig.drive(0).fault, DriveFault::kHomingError);
  EXPECT_THAT(rig.group->sentence(), HasSubstr("j1 found no home"));
  auto config = with_homing(17);
  config.axes[0].homing->timeout_s = 0.5;
  Rig slow(config, incremental(0.8));
  ASSERT_TRUE(waits(slow));
  ask(slow);
  ASSERT_GE(slow.run_until([&] { return slow.state() == DriveGroupState::kFault; }, 5.0), 0.0);
  EXPECT_EQ(slow.drive(0).fault, DriveFault::kHomingTimeout);
  slow.run(1.0);
  slow.reset();
  EXPECT_TRUE(waits(slow)) << slow.group->sentence() << "; after the reset it has to be homed as before";
}

// A power cycle loses the reference, damage too; a new master process does not.
TEST(Homing, ADriveThatLostItsHomeIsHomedAgainAndNoOther) {
  Rig rig(with_homing(35, 2), incremental(0.2));
  ASSERT_TRUE(waits(rig));
  ask(rig);
  ASSERT_TRUE(is_homed(rig));
  ASSERT_TRUE(rig.bring_up());
  rig.command = {.hold = true};
  rig.drives[1]->power_cycle();
  rig.run(0.5);
  EXPECT_EQ(rig.drive(1).fault, DriveFault::kRebooted);
  rig.reset();
  ASSERT_TRUE(waits(rig));
  EXPECT_EQ(rig.group->sentence(), "to be homed, as their encoders are not absolute: j2");
  ask(rig);
  ASSERT_TRUE(is_homed(rig));
  rig.drives[0]->lose_reference();
  rig.drives[0]->trip(0x7305);
  rig.run(0.5);
  rig.reset();
  ASSERT_TRUE(waits(rig));
  EXPECT_EQ(rig.group->sentence(), "to be homed, as their encoders are not absolute: j1");
}

TEST(Homing, AnAbsoluteEncoderIsNeverAsked) {
  Rig rig(test::group_config(DriveMode::kPosition, 2));
  ASSERT_TRUE(rig.bring_up());
  rig.command = {.hold = true, .home = true};
  rig.run(1.0);
  EXPECT_EQ(rig.drive(0).phase, DrivePhase::kQuickStop);
  EXPECT_EQ(rig.drives[0]->motor().joint_rad(), 0.0);
}

TEST(Homing, UsesNoHeap) {
  Rig rig(with_homing(20, 2, DriveMode::kTorque), incremental(0.0));
  bool homed = false;
  for (int i = 0; i < 8000 && !homed; ++i) {
    rig.command = {.hold = true, .home = i > 500};
    {
      const test::HeapGuard guard;
      rig.group->step(rig.command, rig.bus.now_ns());
    }
    rig.master_frozen = true;
    rig.cycle();
    rig.master_frozen = false;
    homed = rig.group->report().has_positions;
  }
  EXPECT_TRUE(homed) << rig.group->sentence();
}

TEST(Homing, WhatMakesNoSenseIsRefusedByName) {
  auto config = with_homing(17);
  config.axes[0].units.offset = 4.0;
  EXPECT_THAT(can::check(config).message(),
              HasSubstr("j1.offset: 4; allowed: where its home is, within its range"));
  config = with_homing(38);
  EXPECT_THAT(can::check(config).message(), HasSubstr("j1.homing.method: 38; allowed: 1 to 37"));
  Rig rig(with_homing(7), incremental(0.0));  // one that this drive has not
  rig.run(1.0);
  EXPECT_THAT(rig.group->sentence(), HasSubstr("refuses object 0x6098:0"));
}

}  // namespace
}  // namespace phantom::homing_test
