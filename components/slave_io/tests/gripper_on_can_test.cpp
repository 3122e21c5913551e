// A gripper's drive beside the arm's on their buses, on a clock of the test's own: repeats exactly.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "common/can/canopen.hpp"
#include "components/slave_io/can_gripper.hpp"
#include "components/slave_io/tests/arm_bench.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::slave_io::gripper_on_can_test {
namespace {

using teleop::LinkState;
using testing::HasSubstr;

constexpr const char* kDrive =
    "gripper: {bus: 1, node: 20, mode: position, counts_per_turn: 4096, travel_per_turn_m: 0.01, "
    "torque_constant_Nm_per_A: 0.05, rated_current_A: 2}";
constexpr const char* kHomedDrive =
    "gripper: {bus: 1, node: 20, mode: position, counts_per_turn: 4096, travel_per_turn_m: 0.01, offset_m: 0.1, "
    "torque_constant_Nm_per_A: 0.05, rated_current_A: 2, homing: {method: 18, search_speed_m_s: 0.02, "
    "zero_speed_m_s: 0.005, acceleration_m_s2: 0.5}}";
constexpr double kObject_m = 0.042, kStiffness_N_per_m = 20'000.0, kRad_per_m = 2.0 * std::numbers::pi / 0.01;

std::filesystem::path file_with(const std::string& drive) {
  const auto file =
      changed("\nforce_observer:",
              "\ngripper: {widest_m: 0.1, max_speed_m_s: 0.1, least_force_N: 3, greatest_force_N: 60, "
              "force_N: 30}\n\nforce_observer:",
              kCanFile);
  return test::changed(file, "by its name in the URDF\n", "by its name in the URDF\n    " + drive + "\n");
}

Config gripper_config(const char* drive = kDrive) {
  Config config = load_config(file_with(drive), shipped_arm().arm, shipped_arm().home);
  for (can::DriveGroupConfig* group : {&config.can->group, &config.gripper.value().drive.value().group}) {
    group->timing.heartbeat_s = 0.02;
    group->timing.heartbeat_timeout_s = 0.05;
    group->timing.most_missed = 3;
    group->timing.boot_timeout_s = 0.2;
  }
  return config;
}

simulated_drive::DriveOptions finger_drive(const can::AxisConfig& axis) {
  constexpr double kMass_kg = 0.5;
  simulated_drive::DriveOptions o = simulated_drive::drive_like(axis, 0.1, kMass_kg);
  o.node = 20;
  o.motor.joint.coulomb = 1.0 / kRad_per_m;
  o.motor.joint.viscous = 5.0 / (kRad_per_m * kRad_per_m);
  o.motor.joint.lower = 0.0;
  o.motor.joint.upper = 0.1 * kRad_per_m;
  o.motor.wall = {.at_rad = kObject_m * kRad_per_m,
                  .stiffness_Nm_per_rad = kStiffness_N_per_m / (kRad_per_m * kRad_per_m),
                  .damping_Nms_per_rad = 20.0 / (kRad_per_m * kRad_per_m)};
  return o;
}

struct Bench : ArmBench {
  explicit Bench(const Config& with = gripper_config(), bool incremental = false) : ArmBench(with) {
    inbox.gripper.open(config.gripper->limits);
    auto options = finger_drive(config.gripper->drive->group.axes.at(0));
    options.incremental = incremental;
    if (incremental) {  // closed, and the switch is where the fingers are open
      options.motor.wall = {};
      options.motor.start_rad = 0.06 * kRad_per_m;
      options.switches.upper_limit = 0.0999 * 4096 / 0.01;
      options.motor.joint.upper = 0.11 * kRad_per_m;
    }
    drive = std::make_unique<simulated_drive::SimulatedDrive>(options, rig.buses[1]->connect("gripper"));
    rig.on_part = [this](core::Nanoseconds now) {
      if (!drive_frozen) drive->step(now);
    };
    begin();
  }
  /// A process of its own: what the drives do is all that is left of the one before.
  void begin() {
    arm = std::make_unique<CanArm>(shipped_arm(), config, rig.connect());
    gripper =
        std::make_unique<CanGripper>(config.gripper->drive->group, rig.buses[1]->connect("slave_io gripper"));
    servo = std::make_unique<Servo>(shipped_arm(), config, *arm, inbox, 1, stops, gripper.get());
  }
  const messages::GripperState& state_of_it() const { return last.gripper.value(); }
  double width_m() const { return drive->motor().joint_rad() / kRad_per_m; }
  double object_N() const { return drive->motor().wall_torque_Nm() * kRad_per_m; }
  bool until(const std::function<bool()>& done, double most_s = 5.0) {
    for (double t = 0; t < most_s && !done(); t += config.period_s) tick();
    return done();
  }
  void grip() {
    ASSERT_TRUE(reaches(LinkState::kCoupled)) << arm->health().message;
    ASSERT_TRUE(until([this] { return state_of_it().sense.follows; })) << gripper->health().message;
    ASSERT_TRUE(inbox.gripper.ask_width(0.0));
    ASSERT_TRUE(until([this] { return state_of_it().holds; })) << width_m() << " m";
    run(0.5);
  }

  std::unique_ptr<simulated_drive::SimulatedDrive> drive;
  std::unique_ptr<CanGripper> gripper;
  bool drive_frozen = false;
};

TEST(CanGripper, ClosesOnAnObjectAndSaysWhatItHolds) {
  Bench bench;
  bench.grip();
  const messages::GripperState& state = bench.state_of_it();
  EXPECT_TRUE(state.holds && !state.moves && !state.closed && !state.sense.fault);
  EXPECT_NEAR(state.sense.width_m, bench.width_m(), 1e-4);
  EXPECT_NEAR(state.sense.force_N, 30.0, 0.5);
  EXPECT_NEAR(bench.object_N(), 30.0, 1.5);
  EXPECT_NEAR(bench.width_m(), kObject_m - 30.0 / kStiffness_N_per_m, 1e-4);
  // Firmer and softer while it holds, by the drive's greatest torque.
  for (const double force_N : {50.0, 8.0}) {
    ASSERT_TRUE(bench.inbox.gripper.ask_force(force_N));
    bench.run(0.5);
    EXPECT_NEAR(bench.object_N(), force_N, 1.5);
    EXPECT_TRUE(bench.state_of_it().holds);
  }
  ASSERT_TRUE(bench.inbox.gripper.ask_width(1.0));
  bench.run(1.5);
  EXPECT_TRUE(bench.state_of_it().open);
  EXPECT_NEAR(bench.width_m(), 0.1, 1e-3);
  EXPECT_EQ(bench.state(), LinkState::kCoupled);
}

TEST(CanGripper, StartsWhereItsFingersAre) {
  Bench bench;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled));
  bench.run(1.0);
  EXPECT_TRUE(bench.state_of_it().sense.follows);
  EXPECT_NEAR(bench.width_m(), 0.1, 1e-4);
}

// Tries slave_io: a stop while the gripper
// Tries slave_io: the master lost meanwhile
TEST(CanGripper, HoldsOnThroughALostLinkAStopAndAReset) {
  Bench bench;
  bench.grip();
  double least_N = 1e9;
  const auto run = [&](double seconds) {
    for (double t = 0; t < seconds; t += bench.config.period_s) {
      bench.tick();
      least_N = std::min(least_N, bench.object_N());
    }
  };
  bench.heard = false;
  run(3.0);
  ASSERT_EQ(bench.state(), LinkState::kDegraded);
  bench.heard = true;
  run(1.0);
  bench.inbox.stops.stop();
  run(2.0);
  ASSERT_EQ(bench.state(), LinkState::kStopped);
  EXPECT_FALSE(bench.inbox.gripper.ask_width(0.1));
  bench.reset();
  run(2.0);
  ASSERT_NE(bench.state(), LinkState::kStopped);
  EXPECT_GT(least_N, 28.0);
  EXPECT_TRUE(bench.state_of_it().holds);
}

// Tries slave_io: the gripper's drive in fault
TEST(CanGripper, ItsFaultIsNamedAndDoesNotStopTheArm) {
  Bench bench;
  bench.grip();
  bench.drive->trip(0x2310);
  bench.run(0.5);
  EXPECT_EQ(bench.state(), LinkState::kCoupled);
  EXPECT_TRUE(bench.arm->health().follows);
  EXPECT_TRUE(bench.state_of_it().sense.fault);
  EXPECT_THAT(bench.gripper->health().message, HasSubstr("gripper is in fault"));
  EXPECT_THAT(bench.gripper->health().message, HasSubstr("0x2310"));
  EXPECT_THAT(bench.gripper->health().message, HasSubstr("until the next request to it"));
  // The next request resets it, and is carried out.
  ASSERT_TRUE(bench.inbox.gripper.ask_width(0.0));
  bench.run(2.0);
  EXPECT_FALSE(bench.state_of_it().sense.fault);
  EXPECT_TRUE(bench.state_of_it().holds);
  EXPECT_NEAR(bench.object_N(), 30.0, 1.5);
}

// Tries slave_io: the gripper's drive … silent
TEST(CanGripper, ASilentOneIsNamedAndDoesNotStopTheArm) {
  Bench bench;
  bench.grip();
  bench.drive_frozen = true;
  bench.run(0.5);
  EXPECT_EQ(bench.state(), LinkState::kCoupled);
  EXPECT_TRUE(bench.state_of_it().sense.fault);
  EXPECT_TRUE(bench.state_of_it().holds) << "what is last known of it";
  EXPECT_THAT(bench.gripper->health().message, HasSubstr("gripper leaves SYNCs without an answer"));
  bench.drive_frozen = false;
  ASSERT_TRUE(bench.inbox.gripper.ask_width(0.0));
  bench.run(3.0);
  EXPECT_FALSE(bench.state_of_it().sense.fault) << bench.gripper->health().message;
  EXPECT_NEAR(bench.object_N(), 30.0, 1.5);
}

TEST(CanGripper, TheArmRunsWithoutIt) {
  Bench bench;
  bench.drive_frozen = true;
  EXPECT_TRUE(bench.reaches(LinkState::kCoupled)) << bench.arm->health().message;
  EXPECT_THAT(bench.gripper->health().message, HasSubstr("gripper has not answered yet"));
  EXPECT_THAT(bench.inbox.gripper.ask_width(0.0).message(), HasSubstr("not ready yet"));
}

TEST(CanGripper, AStopOfTheArmByItsDrivesLeavesTheGrip) {
  Bench bench;
  bench.grip();
  bench.drives[2]->trip(0x2310);
  bench.run(1.0);
  EXPECT_EQ(bench.state(), LinkState::kStopped);
  EXPECT_FALSE(bench.state_of_it().sense.fault);
  EXPECT_NEAR(bench.object_N(), 30.0, 1.5);
}

// slave_io dies, nobody is there for a while, and another one comes: the object is held all the time.
// Tries slave_io: slave_io gone meanwhile
TEST(CanGripper, TheNextProcessTakesTheGripOver) {
  Bench bench;
  ASSERT_TRUE(bench.inbox.gripper.ask_width(0.0).code() != core::ErrorCode::kOk);
  bench.grip();
  ASSERT_TRUE(bench.inbox.gripper.ask_force(20.0));
  bench.run(0.5);
  double least_N = 1e9, most_N = 0.0;
  const auto note = [&] {
    least_N = std::min(least_N, bench.object_N());
    most_N = std::max(most_N, bench.object_N());
  };
  for (int i = 0; i < 500; ++i) {
    bench.miss();
    note();
  }
  EXPECT_NEAR(bench.object_N(), 20.0, 1.5) << "by its drive alone";
  bench.begin();
  bench.last = {};
  bench.published = 0;
  for (int i = 0; i < 2000; ++i) {
    bench.tick();
    note();
  }
  ASSERT_TRUE(bench.state_of_it().sense.follows) << bench.gripper->health().message;
  EXPECT_TRUE(bench.state_of_it().holds);
  EXPECT_NEAR(bench.state_of_it().requested_force_N, 20.0, 1.5);
  EXPECT_GT(least_N, 15.0);
  EXPECT_LT(most_N, 25.0);
}

TEST(CanGripper, IsHomedWhenAPersonAsksForIt) {
  Bench bench(gripper_config(kHomedDrive), true);
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled)) << "the arm does without it";
  bench.run(1.0);
  EXPECT_THAT(bench.gripper->health().message, HasSubstr("to be homed"));
  EXPECT_FALSE(bench.state_of_it().sense.known);
  EXPECT_NEAR(bench.width_m(), 0.06, 1e-4) << "nothing moves before";
  ASSERT_TRUE(bench.inbox.homing.ask());
  ASSERT_TRUE(bench.until([&] { return bench.state_of_it().sense.follows; }, 20.0))
      << bench.gripper->health().message;
  EXPECT_NEAR(bench.state_of_it().sense.width_m, bench.width_m(), 1e-3);
  EXPECT_EQ(bench.state(), LinkState::kCoupled);
}

// Its homing is motion that nobody's hand leads, too; the arm's own drives go on.
TEST(CanGripper, SR19_IsHomedOnlyWhileTheEnablingSwitchIsHeld) {
  Bench bench(gripper_config(kHomedDrive), true);
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled));
  bench.run(1.0);
  bench.master.motion_permitted = false;
  bench.run(0.1);
  EXPECT_THAT(bench.inbox.homing.ask().message(), HasSubstr("an enabling switch is released"));
  bench.master.motion_permitted = true;
  ASSERT_TRUE(bench.reaches(LinkState::kCoupled));
  ASSERT_TRUE(bench.inbox.homing.ask());
  ASSERT_TRUE(bench.until([&] { return bench.width_m() > 0.065; })) << "it opens towards its switch";
  bench.master.motion_permitted = false;
  bench.run(1.0);  // the drive's quick-stop ramp takes 0.6 s
  const double where_m = bench.width_m();
  bench.master.motion_permitted = true;
  bench.run(2.0);
  EXPECT_NEAR(bench.width_m(), where_m, 1e-4) << "only a new request goes on";
  EXPECT_FALSE(bench.state_of_it().sense.known);
  EXPECT_EQ(bench.state(), LinkState::kCoupled);
  ASSERT_TRUE(bench.inbox.homing.ask());
  EXPECT_TRUE(bench.until([&] { return bench.state_of_it().sense.follows; }, 20.0))
      << bench.gripper->health().message;
}

/// Counts what is on a bus.
std::map<std::uint32_t, int> frames_of(can::CanBus& port, Bench& bench, double seconds) {
  std::map<std::uint32_t, int> counts;
  can::Received received;
  while (port.receive(received)) continue;
  for (double t = 0; t < seconds - 1e-9; t += bench.config.period_s) {
    bench.tick();
    while (port.receive(received))
      if (received.is_frame()) ++counts[received.frame.id];
  }
  return counts;
}

TEST(CanGripper, TheArmsDrivesGetTheSameSyncsAndTargets) {
  Bench bench;
  auto port = bench.rig.buses[1]->connect("onlooker");
  bench.grip();
  const auto irregular = [&] {
    std::uint64_t sum = 0;
    for (const auto& drive : bench.arm->drives().drives) sum += drive.missed + drive.surplus;
    return sum;
  };
  const std::uint64_t at_start = irregular();
  const auto counts = frames_of(*port, bench, 1.0);
  const int cycles = static_cast<int>(std::lround(1.0 / bench.config.period_s));
  EXPECT_NEAR(counts.at(can::kCobSync), cycles, 1);
  EXPECT_NEAR(counts.at(can::kCobHeartbeat + 127), 1.0 / 0.02, 3) << "the master's heartbeat, once";
  for (const std::uint32_t node : {1U, 2U, 3U, 20U}) {
    EXPECT_NEAR(counts.at(can::kCobRpdo1 + node), cycles, 1) << node;
    EXPECT_NEAR(counts.at(can::kCobTpdo1 + node), cycles, 1) << node;
  }
  EXPECT_EQ(irregular(), at_start) << "every SYNC answered, once";
}

TEST(CanGripper, TickDoesNotAllocate) {
  Bench bench;
  bench.grip();
  ASSERT_TRUE(bench.inbox.gripper.ask_width(1.0));
  for (int i = 0; i < 500; ++i) {
    bench.now_ns += bench.period_ns;
    bench.renew(bench.master);
    bench.inbox.master.write(bench.master);
    {
      const test::HeapGuard guard;
      bench.servo->tick(bench.config.period_s, bench.now_ns);
    }
    bench.servo->outbox.read(bench.last);
    bench.pass();
  }
  EXPECT_TRUE(bench.state_of_it().moves || bench.state_of_it().open);
}

TEST(CanGripper, ADriveThatCannotBeAGrippersIsRefused) {
  const auto problem = [](const std::string& from, const std::string& to) {
    std::string drive = kDrive;
    drive.replace(drive.find(from), from.size(), to);
    try {
      load_config(file_with(drive), shipped_arm().arm, shipped_arm().home);
    } catch (const core::ConfigError& error) {
      return std::string(error.what());
    }
    return std::string("accepted");
  };
  EXPECT_EQ(problem("node: 20", "node: 21"), "accepted");
  EXPECT_THAT(problem("mode: position", "mode: torque"), HasSubstr("allowed: position"));
  EXPECT_THAT(problem("node: 20", "node: 2"), HasSubstr("is that of j6_wrist on the same bus"));
  EXPECT_THAT(problem("bus: 1", "bus: 2"), HasSubstr("is no place in the list of buses"));
  EXPECT_THAT(problem("rated_current_A: 2", "rated_current_A: 2, following_window_m: 0.002"),
              HasSubstr("following_window_m"));
  EXPECT_THAT(problem("gripper:", "grippers:"), HasSubstr("gripper"));
}

}  // namespace
}  // namespace phantom::slave_io::gripper_on_can_test
