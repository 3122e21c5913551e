// ArmDrives against simulated drives: power only with permission, and what becomes of drives that a killed
// process left behind, in every state of a drive.
#include "common/can/arm_drives.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/can/rig.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom {
namespace {

using can::DriveMode;
using can::FaultReaction;
using simulated_drive::SimulatedDrive;
using Power = SimulatedDrive::Power;
using testing::HasSubstr;

constexpr int kDrives = 2;

/// An arm's drives on one bus, and the process that moves them: it can be killed and started again.
class ArmRig {
 public:
  explicit ArmRig(const can::DriveGroupConfig& with, const simulated_drive::DriveOptions& like = {})
      : config(with), bus({.bit_rate = 1e6}), period_ns_(core::from_seconds(config.timing.period_s)) {
    for (const can::AxisConfig& axis : config.axes) {
      auto options = like;
      options.node = axis.node;
      drives.push_back(std::make_unique<SimulatedDrive>(options, bus.connect(axis.name)));
    }
    start();
  }
  void start() {
    core::JointArray tolerance{};
    tolerance.fill(0.02);
    std::vector<std::unique_ptr<can::CanBus>> ports;
    ports.push_back(bus.connect("process"));
    arm = std::make_unique<can::ArmDrives>(config, tolerance, std::move(ports));
  }
  void kill() { arm.reset(); }  // as kill -9: nothing more is sent

  void cycle() {
    if (arm) {
      arm->sense();
      arm->step(command, bus.now_ns());
    }
    for (int part = 0; part < 4; ++part) {
      bus.advance_to(bus.now_ns() + period_ns_ / 4);
      for (auto& drive : drives) drive->step(bus.now_ns());
    }
  }
  void run(double seconds) {
    for (const auto until = bus.now_ns() + core::from_seconds(seconds); bus.now_ns() < until;) cycle();
  }
  bool run_until(const std::function<bool()>& done, double most_s = 5.0) {
    for (const auto until = bus.now_ns() + core::from_seconds(most_s); bus.now_ns() < until; cycle()) {
      if (done()) return true;
    }
    return done();
  }
  bool all(Power power) const {
    return std::all_of(drives.begin(), drives.end(), [&](const auto& d) { return d->power() == power; });
  }
  bool any(Power power) const {
    return std::any_of(drives.begin(), drives.end(), [&](const auto& d) { return d->power() == power; });
  }
  bool bring_up() {
    command.enable = true;
    return run_until([this] { return arm->report().state == can::DriveGroupState::kEnabled; });
  }

  can::DriveGroupConfig config;
  simulation::LocalBus bus;
  std::vector<std::unique_ptr<SimulatedDrive>> drives;
  std::unique_ptr<can::ArmDrives> arm;
  can::DriveCommand command;

 private:
  core::Nanoseconds period_ns_;
};

class Reactions : public testing::TestWithParam<FaultReaction> {
 protected:
  bool hold() const { return GetParam() == FaultReaction::kHold; }
  can::DriveGroupConfig config(DriveMode mode = DriveMode::kTorque) const {
    return test::group_config(mode, kDrives, GetParam());
  }
};
INSTANTIATE_TEST_SUITE_P(Each, Reactions, testing::Values(FaultReaction::kHold, FaultReaction::kCoast));

TEST_P(Reactions, PowerComesOnlyWithPermission) {
  ArmRig rig(config());
  rig.command.torque.fill(1.0);
  ASSERT_TRUE(rig.run_until([&] { return rig.arm->sense().known; }));
  for (int i = 0; i < 1000; ++i) {
    rig.cycle();
    ASSERT_TRUE(rig.all(Power::kSwitchOnDisabled)) << i;
  }
  EXPECT_EQ(rig.drives[0]->motor().joint_rad(), 0.0);
  EXPECT_FALSE(rig.arm->health().follows);
  EXPECT_THAT(rig.arm->health().message, HasSubstr("power is withheld"));
  rig.command.torque.fill(0.0);
  ASSERT_TRUE(rig.bring_up());
  EXPECT_EQ(rig.arm->health().message, "");
}

TEST_P(Reactions, WithoutPermissionWhatFollowedHoldsOrCoasts) {
  ArmRig rig(config(DriveMode::kVelocity));
  ASSERT_TRUE(rig.bring_up());
  rig.command.velocity.fill(0.5);
  rig.run(0.5);
  rig.command.enable = false;
  rig.run(0.01);
  EXPECT_TRUE(rig.all(hold() ? Power::kQuickStop : Power::kSwitchOnDisabled));
  rig.run(1.0);
  EXPECT_TRUE(rig.all(hold() ? Power::kQuickStop : Power::kSwitchOnDisabled));
  EXPECT_FALSE(rig.arm->health().follows);
  rig.command.velocity.fill(0.0);
  EXPECT_TRUE(rig.bring_up());
}

TEST_P(Reactions, PermissionGivesNoPowerToAnArmThatIsOutOfItsRange) {
  simulated_drive::DriveOptions options;
  options.motor.start_rad = 3.1;
  ArmRig rig(config(), options);
  rig.command.enable = true;
  rig.run(2.0);
  EXPECT_TRUE(rig.all(Power::kSwitchOnDisabled));
  EXPECT_THAT(rig.arm->health().message, HasSubstr("outside its range"));
}

TEST_P(Reactions, NorToAnArmThatIsBeyondItsDrivesOwnLimits) {
  simulated_drive::DriveOptions options;
  options.motor.start_rad = 3.01;  // within the tolerance of 0.02 rad
  auto near = config(), beyond = config();
  near.axes[0].limits_margin = near.axes[1].limits_margin = 0.015;
  beyond.axes[0].limits_margin = beyond.axes[1].limits_margin = 0.005;
  EXPECT_TRUE(ArmRig(near, options).bring_up());
  EXPECT_FALSE(ArmRig(beyond, options).bring_up());
}

TEST_P(Reactions, AnArmIsKnownOnceEveryDriveHasSaidWhereItStands) {
  ArmRig rig(config());
  rig.drives.front()->misbehaviour.mute_pdos = true;
  rig.command.enable = true;
  ASSERT_TRUE(rig.run_until([&] { return rig.arm->report().drives[kDrives - 1].has_position; }));
  for (int i = 0; i < 50; ++i) {
    rig.cycle();
    ASSERT_FALSE(rig.arm->sense().known) << "the first drive has said nothing";
  }
  rig.drives.front()->misbehaviour.mute_pdos = false;
  ASSERT_TRUE(rig.run_until([&] { return rig.arm->sense().known; }));
}

TEST_P(Reactions, TheStepUsesNoHeap) {
  ArmRig rig(config());
  for (int i = 0; i < 2000; ++i) {
    rig.command.enable = i > 500 && i < 1500;
    {
      const test::HeapGuard guard;
      rig.arm->sense();
      rig.arm->step(rig.command, rig.bus.now_ns());
    }
    auto killed = std::move(rig.arm);
    rig.cycle();
    rig.arm = std::move(killed);
  }
}

/// How a process left its drives when it was killed.
struct FormerLife {
  const char* name;
  bool (*reach)(ArmRig&);
  bool powered;  // its drives exert torque
};

bool reach_between(ArmRig& rig, Power power) {
  rig.command.enable = true;
  return rig.run_until([&] { return rig.all(power); }, 2.0);
}

const FormerLife kFormerLives[] = {
    {"not spoken to", [](ArmRig&) { return true; }, false},
    {"being configured",
     [](ArmRig& r) {
       r.run(0.02);
       return true;
     },
     false},
    {"switch on disabled",
     [](ArmRig& r) {
       r.run(1.0);
       return r.all(Power::kSwitchOnDisabled);
     },
     false},
    {"ready to switch on", [](ArmRig& r) { return reach_between(r, Power::kReady); }, false},
    {"switched on", [](ArmRig& r) { return reach_between(r, Power::kSwitchedOn); }, false},
    {"operation enabled",
     [](ArmRig& r) {
       if (!r.bring_up()) return false;
       r.command.torque.fill(1.5);
       r.run(0.1);
       return r.all(Power::kEnabled);
     },
     true},
    {"quick stop active",
     [](ArmRig& r) {
       if (!r.bring_up()) return false;
       r.command.quick_stop = true;
       r.run(0.1);
       return r.all(Power::kQuickStop);
     },
     true},
    {"fault reaction active",
     [](ArmRig& r) {
       if (!r.bring_up()) return false;
       r.command.torque.fill(1.0);
       r.run(0.1);
       for (auto& drive : r.drives) drive->trip(0x2310);
       return r.all(Power::kFaultReaction);
     },
     false},
    {"fault",
     [](ArmRig& r) {
       if (!r.bring_up()) return false;
       for (auto& drive : r.drives) drive->trip(0x2310);
       r.run(0.2);
       return r.all(Power::kFault);
     },
     false},
};

constexpr double kPauses_s[] = {0.0, 0.002, 0.3};  // shorter and longer than the drives wait for a heartbeat

// kill -9 of the process, and its restart with a stop in force: no drive is enabled, in whichever state it
// was left; none goes on with what it was told before.
TEST_P(Reactions, AStopFromTheFirstStepOnPowersNoDriveInWhicheverStateItWasLeft) {
  for (const FormerLife& life : kFormerLives) {
    for (const double pause_s : kPauses_s) {
      SCOPED_TRACE(std::string(life.name) + ", restart after " + std::to_string(pause_s) + " s");
      ArmRig rig(config());
      ASSERT_TRUE(life.reach(rig));
      rig.kill();
      rig.run(pause_s);
      rig.start();
      rig.command = {.quick_stop = true};
      for (int i = 0; i < 10; ++i) {
        rig.cycle();
        ASSERT_FALSE(i > 1 && rig.any(Power::kEnabled)) << i;
      }
      for (int i = 0; i < 1000; ++i) {
        ASSERT_FALSE(rig.any(Power::kEnabled)) << i;
        ASSERT_FALSE(rig.any(Power::kReady) || rig.any(Power::kSwitchedOn)) << i;
        if (i > 100 && life.powered && hold()) {
          ASSERT_NEAR(rig.drives[0]->motor().joint_rad_s(), 0.0, 1e-3) << i;
        } else if (i > 100) {
          ASSERT_EQ(rig.drives[0]->torque_mille(), 0.0) << i;
        }
        rig.cycle();
      }
      // Whoever had power either holds, or has none.
      for (const auto& drive : rig.drives) {
        if (drive->power() == Power::kQuickStop) {
          EXPECT_TRUE(life.powered);
        } else {
          EXPECT_TRUE(drive->power() == Power::kSwitchOnDisabled || drive->power() == Power::kFault);
        }
      }
      if (hold() && life.powered) {
        EXPECT_TRUE(rig.all(Power::kQuickStop));
      }
      // A reset of the stop; that of the drives' faults is a rising edge.
      rig.command = {.reset = true};
      rig.cycle();
      rig.command = {};
      EXPECT_TRUE(rig.bring_up()) << rig.arm->health().message;
    }
  }
}

// The same with permission withheld instead of a stop: the process does not know yet whether it may.
TEST_P(Reactions, WithheldPowerFromTheFirstStepOnPowersNoDriveInWhicheverStateItWasLeft) {
  for (const FormerLife& life : kFormerLives) {
    for (const double pause_s : kPauses_s) {
      SCOPED_TRACE(std::string(life.name) + ", restart after " + std::to_string(pause_s) + " s");
      ArmRig rig(config());
      ASSERT_TRUE(life.reach(rig));
      rig.kill();
      rig.run(pause_s);
      rig.start();
      rig.command = {};
      for (int i = 0; i < 10; ++i) {
        rig.cycle();
        ASSERT_FALSE(i > 1 && rig.any(Power::kEnabled)) << i;
      }
      for (int i = 0; i < 500; ++i) {
        ASSERT_FALSE(rig.any(Power::kEnabled)) << i;
        ASSERT_FALSE(rig.any(Power::kReady) || rig.any(Power::kSwitchedOn)) << i;
        rig.cycle();
      }
      if (hold() && life.powered) {
        EXPECT_TRUE(rig.all(Power::kQuickStop)) << "it held, and goes on holding";
      }
    }
  }
}

// Enabled by another tool, which told it to ignore a lost connection: the reset of the communication alone
// does not stop it.
TEST_P(Reactions, ADriveThatSomebodyElseEnabledIsStoppedAtOnce) {
  ArmRig rig(config());
  ASSERT_TRUE(rig.bring_up());
  rig.command.torque.fill(1.5);
  rig.run(0.05);
  rig.kill();
  auto tool = rig.bus.connect("tool");
  for (std::uint8_t node = 1; node <= kDrives; ++node) {
    for (const std::array<std::uint8_t, 8>& request :
         {std::array<std::uint8_t, 8>{0x2B, 0x07, 0x60, 0, 0, 0, 0, 0},     // 0x6007 = 0: do nothing
          std::array<std::uint8_t, 8>{0x23, 0x16, 0x10, 1, 0, 0, 0, 0}}) {  // 0x1016: no heartbeat is watched
      tool->send({.id = 0x600U + node, .length = 8, .data = request});
      rig.cycle();
    }
  }
  rig.run(0.2);
  ASSERT_TRUE(rig.all(Power::kEnabled)) << "as a tool would have left them";
  rig.start();
  rig.command = {.quick_stop = true};
  rig.run(0.02);
  EXPECT_TRUE(rig.all(hold() ? Power::kQuickStop : Power::kSwitchOnDisabled));
  for (int i = 0; i < 500; ++i) {
    rig.cycle();
    ASSERT_FALSE(rig.any(Power::kEnabled));
  }
}

// Tries slave_io: a drive refuses a setting before any was ready
TEST(ArmDrives, ASettingThatIsRefusedAtTheStartIsToldAndIsNoFaultThatAResetEnds) {
  ArmRig rig(test::group_config(DriveMode::kTorque, kDrives));
  rig.drives[1]->misbehaviour.lacks_object = 0x605A;
  EXPECT_FALSE(rig.bring_up());
  EXPECT_EQ(rig.arm->report().state, can::DriveGroupState::kFault);
  EXPECT_FALSE(rig.arm->sense().fault) << "no stop that the next process would keep";
  EXPECT_FALSE(rig.arm->sense().follows);
  EXPECT_FALSE(rig.any(Power::kEnabled));
  const core::ActuatorHealth health = rig.arm->health();
  EXPECT_TRUE(health.fault);
  EXPECT_THAT(health.message, testing::AllOf(HasSubstr("0x605A"), HasSubstr("then restart this process")));
  rig.kill();  // corrected
  rig.drives[1]->misbehaviour.lacks_object = 0;
  rig.start();
  EXPECT_TRUE(rig.bring_up());
}

TEST(ArmDrives, ASettingThatIsRefusedOnceTheDrivesWereReadyIsAFaultUntilAReset) {
  ArmRig rig(test::group_config(DriveMode::kTorque, kDrives));
  ASSERT_TRUE(rig.bring_up());
  rig.drives[1]->misbehaviour.lacks_object = 0x605A;
  rig.drives[1]->power_cycle();
  ASSERT_TRUE(rig.run_until([&] { return rig.arm->report().state == can::DriveGroupState::kFault; }));
  rig.command.reset = true;
  rig.run(3.0);
  EXPECT_TRUE(rig.arm->sense().fault);
  EXPECT_THAT(rig.arm->health().message, HasSubstr("until a reset"));
}

// Without a stop: what holds a weight is not let go while the new process comes up.
TEST(ArmDrives, ARestartedProcessDoesNotDropWhatItsDrivesHold) {
  simulated_drive::DriveOptions options;
  options.motor.load_Nm = 2.0;
  ArmRig rig(test::group_config(DriveMode::kPosition, kDrives), options);
  ASSERT_TRUE(rig.bring_up());
  rig.run(0.5);
  rig.kill();
  rig.run(0.3);
  ASSERT_TRUE(rig.all(Power::kQuickStop));
  const double held_rad = rig.drives[0]->motor().joint_rad();
  rig.start();
  rig.command = {.enable = true};
  rig.command.position.fill(held_rad);
  for (int i = 0; i < 1500; ++i) {
    rig.cycle();
    ASSERT_FALSE(rig.any(Power::kSwitchOnDisabled)) << i;
    ASSERT_NEAR(rig.drives[0]->motor().joint_rad(), held_rad, 5e-3) << i;
  }
  EXPECT_TRUE(rig.all(Power::kEnabled));
}

}  // namespace
}  // namespace phantom
