// The enabling switch of either side in the whole system: master and slave as they run, on a clock of the
// test's own. Bounds are in its milliseconds.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/faults/pair.hpp"

namespace phantom::faults {
namespace {

using teleop::LinkState;
using teleop::SwitchState;
using Source = runtime::EnablingSwitchConfig::Source;

master_io::Config master_with(Source source) {
  auto config = Pair::master_config();
  config.enabling_switch.emplace().source = source;
  return config;
}

// A slave with drives on CAN, whose fourth joint's drive has a switch with two contacts on its terminals.
constexpr std::size_t kWired = 3;
slave_io::Config slave_with_switch() {
  auto config = slave_io::can_config();
  config.can->group.axes[kWired].digital_inputs = true;
  auto& wired = config.enabling_switch.emplace();
  wired.source = Source::kDrive;
  wired.first.bit = 16;
  wired.second.bit = 17;
  return config;
}

bool coupled(const Pair& pair) {
  return pair.master_state() == LinkState::kCoupled && pair.slave_state() == LinkState::kCoupled;
}

// A pair with the person who holds the master's switch, on an input device.
struct Bench {
  explicit Bench(const master_io::Config& master = master_with(Source::kInput),
                 const slave_io::Config& slave = slave_io::shipped_config())
      : pair(master, slave) {}
  void step(int ms = 1) {
    for (int i = 0; i < ms; ++i) {
      if (reads) {
        reading.at_ns = pair.now_ns + kTick_ns;
        pair.master_switch().write(reading);
      }
      const auto before = pair.slave_now.position;
      const bool knew = was_known;
      pair.step();
      was_known = pair.slave_now.joint_count != 0;
      if (!knew) continue;
      for (std::size_t j = 0; j < kJoints; ++j) {
        const double most = 1.2 * slave_io::shipped_arm().arm.joints()[j].max_speed * kTick_s *
                                (pair.slave_config().period_s / kTick_s) +
                            2.0 * pair.slave_config().plant.encoder_resolution[j] + 1e-4;
        EXPECT_LE(std::abs(pair.slave_now.position[j] - before[j]), most) << "the arm jumps, joint " << j;
      }
    }
  }
  void hold(bool held) {
    reading.contacts.read = true;
    reading.contacts.first = reading.contacts.second = held;
  }
  bool couples(int most_ms = 6000) {
    for (int ms = 0; ms < most_ms && !coupled(pair); ++ms) step();
    return coupled(pair);
  }
  // Until the arm is on its way.
  void go() {
    double speed = 0.0;
    for (int i = 0; i < 8000 && speed < 0.1; ++i) {
      step();
      speed = 0.0;
      if (!coupled(pair)) continue;
      for (std::size_t j = 0; j < kJoints; ++j) speed = std::max(speed, std::abs(pair.slave_now.velocity[j]));
    }
    ASSERT_GE(speed, 0.1);
  }
  // Milliseconds until the slave does not follow any more.
  int slave_leaves(int most_ms = 2000) {
    int ms = 0;
    while (pair.slave_state() == LinkState::kCoupled && ms < most_ms) step(), ++ms;
    return ms;
  }
  // The arm comes to rest where it was and stays there; the hand's torque is gone, within a ramp.
  void expect_held(int ms = 3000) {
    const auto where = pair.slave_now.position;
    const auto& master = pair.master_config();
    const double ramp_s = std::max(master.percept.ramp_down_s, master.feedback.ramp_down_s);
    step(static_cast<int>(1000 * ramp_s) + 25);
    for (int i = 0; i < ms && !testing::Test::HasFailure(); ++i) {
      step();
      EXPECT_FALSE(coupled(pair));
      for (std::size_t j = 0; j < kJoints; ++j) {
        EXPECT_EQ(pair.master_now.outputs.motor_Nm[j], 0.0);
        EXPECT_NEAR(pair.slave_now.position[j], where[j], 0.02) << j;
      }
    }
  }

  Pair pair;
  runtime::SwitchReading reading{.contacts = {.read = true}};
  bool reads = true;  ///< false: the thread that reads the device hangs
  bool was_known = false;
};

// Tries slave_io: an enabling switch is not held
TEST(EnablingSwitchOfTheMaster, SR19_TheArmFollowsOnlyWhileItIsHeldAndHoldsWithinThreeMilliseconds) {
  Bench bench;
  bench.step(3000);
  EXPECT_EQ(bench.pair.master_state(), LinkState::kInit);
  EXPECT_EQ(bench.pair.slave_state(), LinkState::kInit) << "it was never held";
  EXPECT_TRUE(bench.pair.master_now.switch_fitted);
  EXPECT_FALSE(bench.pair.master_now.motion_permitted);
  EXPECT_FALSE(bench.pair.slave_now.switch_fitted);
  EXPECT_EQ(teleop::switch_sentence(bench.pair.master_now.outputs, "slave"),
            "enabling switch released: the arm holds");
  EXPECT_EQ(teleop::switch_sentence(bench.pair.slave_now.outputs, "master"),
            "the master's enabling switch is not held: the arm holds");
  EXPECT_EQ(teleop::component_state(bench.pair.slave_now.outputs), core::ComponentState::kReady);
  bench.hold(true);
  ASSERT_TRUE(bench.couples());
  bench.go();
  bench.hold(false);
  // One tick of the master, the wire, one tick of the slave.
  EXPECT_LE(bench.slave_leaves(), 3);
  EXPECT_EQ(bench.pair.slave_state(), LinkState::kDegraded);
  bench.expect_held();
  EXPECT_EQ(bench.pair.master_now.outputs.stop.id, 0U) << "letting go is no stop";
  bench.hold(true);
  EXPECT_TRUE(bench.couples()) << "by itself, through alignment";
}

// The worst that the wire can do: the sample that says so is lost, and all after it.
TEST(EnablingSwitchOfTheMaster, SR19_WithTheWireCutInThatMomentTheArmHoldsWithinTheStaleness) {
  Bench bench;
  bench.step(100);
  bench.hold(true);
  ASSERT_TRUE(bench.couples());
  bench.go();
  bench.pair.up.cut = true;
  bench.hold(false);
  EXPECT_LE(bench.slave_leaves(), static_cast<int>(1000 * bench.pair.slave_config().link.staleness_s) + 2);
  bench.expect_held(500);
}

TEST(EnablingSwitchOfTheMaster, SR19_UnpluggedHungAndPressedThroughAreLetGo) {
  const auto stale_ms = static_cast<int>(1000 * teleop::EnablingSwitchParameters().stale_s);
  const struct {
    const char* what;
    void (*happens)(Bench&);
    void (*ends)(Bench&);
    int most_ms;
    SwitchState state;
    core::ComponentState shown;
  } cases[] = {
      {"unplugged", [](Bench& b) { b.reading.contacts = {}; }, [](Bench& b) { b.hold(true); }, 3,
       SwitchState::kAbsent, core::ComponentState::kDegraded},
      {"its thread hangs", [](Bench& b) { b.reads = false; }, [](Bench& b) { b.reads = true; }, stale_ms + 3,
       SwitchState::kAbsent, core::ComponentState::kDegraded},
      {"pressed through", [](Bench& b) { b.reading.contacts.through = true; },
       [](Bench& b) { b.reading.contacts.through = false; }, 3, SwitchState::kPressedThrough,
       core::ComponentState::kReady},
      {"one contact", [](Bench& b) { b.reading.contacts.second = false; },
       [](Bench& b) { b.reading.contacts.second = true; }, 3, SwitchState::kContactsDiffer,
       core::ComponentState::kFault},
  };
  for (const auto& one : cases) {
    SCOPED_TRACE(one.what);
    Bench bench;
    bench.step(100);
    bench.hold(true);
    ASSERT_TRUE(bench.couples());
    bench.go();
    one.happens(bench);
    EXPECT_LE(bench.slave_leaves(), one.most_ms);
    bench.expect_held(600);
    EXPECT_EQ(bench.pair.master_now.outputs.enabling, one.state);
    EXPECT_EQ(teleop::component_state(bench.pair.master_now.outputs), one.shown);
    one.ends(bench);
    EXPECT_FALSE(bench.couples(2000)) << "held, but it was not released";
    bench.hold(false);
    bench.step(100);
    bench.hold(true);
    EXPECT_TRUE(bench.couples());
    ASSERT_FALSE(testing::Test::HasFailure());
  }
}

TEST(EnablingSwitchOfTheMaster, SR19_OneThatIsTiedDownAtTheStartPermitsNothing) {
  Bench bench;
  bench.hold(true);
  EXPECT_FALSE(bench.couples(4000));
  EXPECT_EQ(bench.pair.master_now.outputs.enabling, SwitchState::kToBeReleased);
  // Nor in a master that takes the place of one that was coupled with it held.
  bench.hold(false);
  bench.step(100);
  bench.hold(true);
  ASSERT_TRUE(bench.couples());
  bench.pair.master_life = Life::kGone;
  bench.step(1000);
  bench.pair.start_master();
  EXPECT_FALSE(bench.couples(4000));
}

TEST(EnablingSwitchOfTheMaster, SR19_TheSimulatedOperatorHoldsItWhileReachingAndLetsGoAtTheTimesGiven) {
  auto config = master_with(Source::kSimulated);
  config.enabling_switch->let_go_s = {4.0};
  config.enabling_switch->let_go_for_s = 1.0;
  Bench bench(config);
  EXPECT_TRUE(bench.couples(3000));
  while (coupled(bench.pair) && bench.pair.now_ns < 6 * core::kNsPerSecond) bench.step();
  EXPECT_NEAR(core::seconds(bench.pair.now_ns) - 1.0, 4.0, 0.005) << "the rig's clock begins at 1 s";
  bench.step(900);
  EXPECT_FALSE(coupled(bench.pair));
  EXPECT_TRUE(bench.couples());
  EXPECT_GE(bench.pair.master_now.reach, 0) << "reaches go on";
}

TEST(EnablingSwitchOnADrive, SR19_PulledTheArmHoldsWithinTwoPeriodsAndAStuckContactIsAFault) {
  Bench bench(Pair::master_config(), slave_with_switch());
  auto& drive = *bench.pair.rig->drives[kWired];
  EXPECT_FALSE(bench.couples(4000)) << "it is not held";
  EXPECT_EQ(bench.pair.slave_now.outputs.enabling, SwitchState::kReleased);
  drive.hold_switch(true);
  ASSERT_TRUE(bench.couples());
  bench.go();
  drive.hold_switch(false);
  // It is in the answer to the next SYNC, which the tick after that takes.
  const auto period_ms = static_cast<int>(1000 * bench.pair.slave_config().period_s);
  EXPECT_LE(bench.slave_leaves(), 2 * period_ms + 1);
  bench.expect_held();
  drive.hold_switch(true);
  ASSERT_TRUE(bench.couples());
  bench.go();
  drive.misbehaviour.stuck_inputs = 1U << 17;  // the second contact does not open
  drive.hold_switch(false);
  EXPECT_LE(bench.slave_leaves(), 2 * period_ms + 1) << "the first one counts at once";
  bench.step(510);
  EXPECT_EQ(bench.pair.slave_now.outputs.enabling, SwitchState::kContactsDiffer);
  EXPECT_EQ(teleop::component_state(bench.pair.slave_now.outputs), core::ComponentState::kFault);
  drive.hold_switch(true);
  EXPECT_FALSE(bench.couples(3000)) << "never again while it sticks";
  drive.misbehaviour.stuck_inputs = 0;
  drive.hold_switch(false);
  bench.step(100);
  drive.hold_switch(true);
  EXPECT_TRUE(bench.couples());
}

TEST(EnablingSwitchOnADrive, SR19_ADriveWhoseInputsDoNotComeAnyMoreIsNoSwitchAndNoFaultOfTheArm) {
  Bench bench(Pair::master_config(), slave_with_switch());
  auto& drive = *bench.pair.rig->drives[kWired];
  bench.couples(2000);
  drive.hold_switch(true);
  ASSERT_TRUE(bench.couples());
  bench.go();
  drive.misbehaviour.mute_inputs = true;
  EXPECT_LE(bench.slave_leaves(), static_cast<int>(1000 * teleop::EnablingSwitchParameters().stale_s) + 4);
  EXPECT_EQ(bench.pair.slave_now.outputs.enabling, SwitchState::kAbsent);
  EXPECT_FALSE(bench.pair.slave_drives().fault);
  bench.expect_held(500);
  drive.misbehaviour.mute_inputs = false;
  EXPECT_FALSE(bench.couples(2000)) << "it may have been tied down meanwhile";
  drive.hold_switch(false);
  bench.step(100);
  drive.hold_switch(true);
  EXPECT_TRUE(bench.couples());
}

TEST(EnablingSwitches, SR19_WithOneOnEitherSideBothHaveToBeHeld) {
  Bench bench(master_with(Source::kInput), slave_with_switch());
  auto& drive = *bench.pair.rig->drives[kWired];
  bench.couples(2000);
  bench.hold(true);
  EXPECT_FALSE(bench.couples(2000));
  drive.hold_switch(true);
  ASSERT_TRUE(bench.couples());
  bench.hold(false);
  EXPECT_LE(bench.slave_leaves(), 5);
  bench.hold(true);
  bench.step(100);
  bench.hold(false);
  bench.step(100);
  bench.hold(true);
  ASSERT_TRUE(bench.couples());
  drive.hold_switch(false);
  EXPECT_LE(bench.slave_leaves(), 5);
  EXPECT_FALSE(bench.couples(2000));
}

// The way to alignment is motion, too.
// Tries slave_io: an enabling switch is not held
TEST(EnablingSwitches, SR19_WithoutThemTheArmDoesNotComeToTheMastersPose) {
  const auto& arm = slave_io::shipped_arm();
  for (const bool own : {true, false}) {
    slave_io::SlaveIo controller(arm.arm, slave_io::shipped_config(), arm.home, teleop::StopLatch(1, {}));
    slave_io::SlaveInputs in;
    in.partner_age_s = 0.0;
    in.position = arm.home;
    in.master.position = arm.home;
    in.master.position[1] += 0.1;
    in.master.state = LinkState::kReady;
    const auto run = [&](bool held) {
      in.enabling = own && !held ? SwitchState::kReleased : SwitchState::kNotFitted;
      in.master.motion_permitted = own || held;
      slave_io::SlaveOutputs out;
      for (int i = 0; i < 1000; ++i) out = controller.step(in, kTick_s);
      return out.reference[1];
    };
    EXPECT_EQ(run(false), arm.home[1]);
    const double come = run(true);
    EXPECT_GT(come, arm.home[1] + 0.01);
    in.position[1] = come;
    EXPECT_EQ(run(false), come) << "and it stops on its way";
  }
}

}  // namespace
}  // namespace phantom::faults
