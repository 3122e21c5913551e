// Every fault in every state: what the drives' state becomes, how long that takes, and that no arm jumps.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <set>

#include "tests/can/rig.hpp"

namespace phantom::drive_fault_test {
namespace {

using can::DriveFault;
using can::DriveGroupState;
using can::DriveMode;
using can::DrivePhase;
using can::FaultReaction;
using test::group_config;
using test::Rig;
using Power = simulated_drive::SimulatedDrive::Power;

struct Situation {
  const char* name;
  bool (*reach)(Rig&);
  bool connected;  // the drives are configured and operational
};

bool phase_is(Rig& rig, DrivePhase phase) { return rig.drive(0).phase == phase; }

const Situation kSituations[] = {
    {"searching",
     [](Rig& rig) {
       rig.group->step(rig.command, rig.bus.now_ns());
       return phase_is(rig, DrivePhase::kSearching);
     },
     false},
    {"configuring",
     [](Rig& rig) { return rig.run_until([&] { return phase_is(rig, DrivePhase::kConfiguring); }, 1) >= 0; },
     false},
    {"ready",
     [](Rig& rig) { return rig.run_until([&] { return rig.state() == DriveGroupState::kReady; }, 2) >= 0; },
     true},
    {"enabled, moving",
     [](Rig& rig) {
       if (!rig.bring_up()) return false;
       rig.command.velocity.fill(0.5);
       rig.run(0.5);
       return true;
     },
     true},
    {"quick stop",
     [](Rig& rig) {
       if (!rig.bring_up()) return false;
       rig.command.quick_stop = true;
       rig.run(0.2);
       return rig.state() == DriveGroupState::kQuickStop;
     },
     true},
};

struct Fault {
  const char* name;
  void (*begin)(Rig&);
  void (*end)(Rig&);
  std::set<DriveFault>
      when_connected;  // the names it may go by; empty: not noticed in this state, or harmless
};

const Fault kFaults[] = {
    {"drive killed",
     [](Rig& r) {
       r.bus.set_plugged(r.drives[0]->bus(), false);
       r.frozen[0] = true;
     },
     [](Rig& r) {
       r.bus.set_plugged(r.drives[0]->bus(), true);
       r.frozen[0] = false;
       r.drives[0]->power_cycle();
     },
     {DriveFault::kFeedbackMissing}},
    {"drive frozen",
     [](Rig& r) { r.frozen[0] = true; },
     [](Rig& r) { r.frozen[0] = false; },
     {DriveFault::kFeedbackMissing}},
    {"cable cut",
     [](Rig& r) { r.bus.set_plugged(r.drives[0]->bus(), false); },
     [](Rig& r) { r.bus.set_plugged(r.drives[0]->bus(), true); },
     {DriveFault::kFeedbackMissing}},
    {"all frames lost",
     [](Rig& r) { r.bus.set_faults({{.drop = 1.0}}); },
     [](Rig& r) { r.bus.set_faults({}); },
     {DriveFault::kFeedbackMissing}},
    {"frames 30 ms late",
     [](Rig& r) { r.bus.set_faults({{.delay_ns = 30'000'000}}); },
     [](Rig& r) { r.bus.set_faults({}); },
     {DriveFault::kFeedbackMissing}},
    {"heartbeat stops",
     [](Rig& r) { r.drives[0]->misbehaviour.mute_heartbeat = true; },
     [](Rig& r) { r.drives[0]->misbehaviour.mute_heartbeat = false; },
     {DriveFault::kHeartbeatLost}},
    {"SYNCs unanswered",
     [](Rig& r) { r.drives[0]->misbehaviour.mute_pdos = true; },
     [](Rig& r) { r.drives[0]->misbehaviour.mute_pdos = false; },
     {DriveFault::kFeedbackMissing}},
    {"speed and torque missing",
     [](Rig& r) { r.drives[0]->misbehaviour.mute_measurement = true; },
     [](Rig& r) { r.drives[0]->misbehaviour.mute_measurement = false; },
     {DriveFault::kMeasurementMissing}},
    {"other mode",
     [](Rig& r) { r.drives[0]->misbehaviour.shown_mode = 1; },
     [](Rig& r) { r.drives[0]->misbehaviour.shown_mode = 0; },
     {DriveFault::kModeMismatch}},
    {"PDO too short",
     [](Rig& r) { r.drives[0]->misbehaviour.cut_pdo_bytes = 1; },
     [](Rig& r) { r.drives[0]->misbehaviour.cut_pdo_bytes = 0; },
     {DriveFault::kPdoLength}},
    {"node id twice",
     [](Rig& r) {
       simulated_drive::DriveOptions twin{.node = 1};
       r.add(twin);
     },
     [](Rig& r) {
       r.drives.pop_back();
       r.frozen.pop_back();
     },
     {DriveFault::kDuplicateNode, DriveFault::kRebooted}},
    {"over-current",
     [](Rig& r) { r.drives[0]->trip(0x2310); },
     [](Rig&) {},
     {DriveFault::kEmergency, DriveFault::kDriveFault}},
    {"emergency message", [](Rig& r) { r.drives[0]->warn(0x4310); }, [](Rig&) {}, {DriveFault::kEmergency}},
    {"drive reboots", [](Rig& r) { r.drives[0]->power_cycle(); }, [](Rig&) {}, {DriveFault::kRebooted}},
    {"power stage off", [](Rig& r) { r.drives[0]->cut_power(); }, [](Rig&) {}, {DriveFault::kLeftEnabled}},
    {"bus-off", [](Rig& r) { r.bus.set_bus_off(*r.port); }, [](Rig&) {}, {DriveFault::kBusOff}},
};

bool is_harmless(const Fault& fault, const Situation& situation) {
  const std::string f = fault.name, s = situation.name;
  return f == "power stage off" && s != "enabled, moving";
}

struct Outcome {
  std::string state;
  double found_ms = -1.0;
  double moved_rad = 0.0;  // after the fault, of the drives that still hold
  bool recovered = false;
  std::string why;
};

Outcome run_case(const Fault& fault, const Situation& situation, FaultReaction reaction) {
  Outcome out;
  Rig rig(group_config(DriveMode::kVelocity, 2, reaction));
  EXPECT_TRUE(situation.reach(rig)) << situation.name;
  const double before = rig.drives[1]->motor().joint_rad();
  fault.begin(rig);
  out.found_ms = rig.run_until([&] { return rig.state() == DriveGroupState::kFault; }, 1.5);
  rig.run(0.5);
  const can::DriveReport& report = rig.drive(0);
  out.state = report.phase == DrivePhase::kFault ? std::string("fault: ") + name_of(report.fault)
                                                 : name_of(rig.state());
  out.moved_rad = std::abs(rig.drives[1]->motor().joint_rad() - before);
  if (situation.connected && !is_harmless(fault, situation)) {
    EXPECT_EQ(rig.state(), DriveGroupState::kFault) << fault.name << " in " << situation.name;
    EXPECT_TRUE(fault.when_connected.contains(report.fault))
        << fault.name << " in " << situation.name << " became " << name_of(report.fault);
    // No drive follows any more, whatever is commanded.
    EXPECT_NE(rig.drives[1]->power(), Power::kEnabled) << fault.name << " in " << situation.name;
    if (reaction == FaultReaction::kHold) {
      EXPECT_LT(std::abs(rig.drives[1]->motor().joint_rad_s()), 1e-3)
          << fault.name << " in " << situation.name;
    }
  }
  fault.end(rig);
  rig.command = {};
  rig.run(0.3);  // what had piled up goes over the bus
  rig.reset();
  out.recovered = rig.bring_up();
  out.why = rig.group->sentence();
  return out;
}

class FaultTable : public testing::TestWithParam<FaultReaction> {};

// Tries slave_io: silent or frozen … bus-off
TEST_P(FaultTable, EveryFaultInEveryStateIsNamedInTimeAndMovesNothing) {
  const bool hold = GetParam() == FaultReaction::kHold;
  std::ofstream table(std::string(PHANTOM_BUILD_DIR) +
                      (hold ? "/drive_faults_hold.md" : "/drive_faults_coast.md"));
  table << "Drives at 500 Hz, velocity mode, reaction " << (hold ? "hold" : "coast")
        << ": state reached after each fault in each state, ms until it was known, "
           "and how far the sound drive went on.\n\n| fault |";
  for (const Situation& s : kSituations) table << ' ' << s.name << " |";
  table << "\n|---|---|---|---|---|---|\n";
  for (const Fault& fault : kFaults) {
    table << "| " << fault.name << " |";
    for (const Situation& situation : kSituations) {
      SCOPED_TRACE(std::string(fault.name) + " in " + situation.name);
      const Outcome outcome = run_case(fault, situation, GetParam());
      table << ' ' << outcome.state;
      if (outcome.found_ms >= 0.0) table << ", " << outcome.found_ms << " ms";
      table << ", " << std::round(outcome.moved_rad * 1e4) * 0.1 << " mrad |";
      EXPECT_TRUE(outcome.recovered) << outcome.why;
      const bool must_be_found = situation.connected && !is_harmless(fault, situation);
      if (must_be_found) {
        EXPECT_GE(outcome.found_ms, 0.0);
        EXPECT_LE(outcome.found_ms, 200.0);
      }
      if (hold) {
        EXPECT_LT(outcome.moved_rad, 0.5 * 0.25 + 0.02);  // at 0.5 rad/s, for as long as it may take
      }
    }
    table << '\n';
  }
}

INSTANTIATE_TEST_SUITE_P(Reactions, FaultTable, testing::Values(FaultReaction::kHold, FaultReaction::kCoast));

// Tries slave_io: stands still
// Tries master_io: stands still
// Tries simulated_drive: the master's heartbeat stops
TEST(DriveFaults, SR16_AFrozenMasterMakesTheDrivesHoldByThemselves) {
  Rig rig(group_config(DriveMode::kVelocity, 2));
  ASSERT_TRUE(rig.bring_up());
  rig.command.velocity.fill(0.5);
  rig.run(0.5);
  rig.master_frozen = true;
  rig.run(0.5);
  for (const auto& drive : rig.drives) {
    EXPECT_EQ(drive->power(), Power::kQuickStop);
    EXPECT_NEAR(drive->motor().joint_rad_s(), 0.0, 1e-3);
  }
  const double held = rig.drives[0]->motor().joint_rad();
  rig.master_frozen = false;
  rig.run(0.5);
  EXPECT_EQ(rig.state(), DriveGroupState::kFault);
  EXPECT_NEAR(rig.drives[0]->motor().joint_rad(), held, 1e-3);
}

// As of a drive whose firmware hung: it missed that the master stopped it, and the master's asking it to boot
// is lost too. It still has the torque of before.
TEST(DriveFaults, ADriveThatComesBackWithItsLastTorqueIsStoppedBeforeItBoots) {
  for (const FaultReaction reaction : {FaultReaction::kHold, FaultReaction::kCoast}) {
    Rig rig(group_config(DriveMode::kTorque, 1, reaction));
    ASSERT_TRUE(rig.bring_up());
    rig.command.torque[0] = 2.0;
    rig.run(0.01);
    rig.frozen[0] = true;
    rig.bus.set_faults({{.drop = 1.0}});
    ASSERT_GE(rig.run_until([&] { return rig.state() == DriveGroupState::kFault; }, 1.0), 0.0);
    rig.frozen[0] = false;
    rig.bus.set_faults({{.id = can::kCobNmt, .mask = 0x7FF, .drop = 1.0}});
    rig.command.reset = true;
    ASSERT_EQ(rig.drives[0]->power(), Power::kEnabled);
    rig.run(0.01);
    EXPECT_EQ(rig.drive(0).phase, DrivePhase::kSearching);
    EXPECT_EQ(rig.drives[0]->power(),
              reaction == FaultReaction::kHold ? Power::kQuickStop : Power::kSwitchOnDisabled);
    rig.bus.set_faults({});
    rig.command.torque[0] = 0.0;
    EXPECT_TRUE(rig.bring_up());
  }
}

TEST(DriveFaults, HoldingGoesOnThroughAResetUnderAWeight) {
  simulated_drive::DriveOptions options;
  options.motor.load_Nm = 2.0;
  Rig rig(group_config(DriveMode::kPosition, 2), options);
  ASSERT_TRUE(rig.bring_up());
  rig.drives[0]->misbehaviour.mute_heartbeat = true;
  rig.run(0.3);
  ASSERT_EQ(rig.drive(0).fault, DriveFault::kHeartbeatLost);
  rig.drives[0]->misbehaviour.mute_heartbeat = false;
  const double held[] = {rig.drives[0]->motor().joint_rad(), rig.drives[1]->motor().joint_rad()};
  rig.command.position = rig.group->report().position;
  rig.reset();
  for (int i = 0; i < 1000; ++i) {
    rig.cycle();
    for (std::size_t d = 0; d < 2; ++d) ASSERT_NEAR(rig.drives[d]->motor().joint_rad(), held[d], 5e-3) << i;
  }
  EXPECT_EQ(rig.state(), DriveGroupState::kEnabled);
}

TEST(DriveFaults, SR05_AfterAFaultNothingFollowsWithoutAReset) {
  Rig rig(group_config(DriveMode::kVelocity, 2));
  ASSERT_TRUE(rig.bring_up());
  rig.drives[0]->trip(0x2310);
  rig.run(0.2);
  rig.command.enable = false;
  rig.run(0.2);
  rig.command.enable = true;
  rig.command.velocity.fill(0.5);
  rig.run(1.0);
  EXPECT_EQ(rig.state(), DriveGroupState::kFault);
  EXPECT_NEAR(rig.drives[1]->motor().joint_rad_s(), 0.0, 1e-3);
  EXPECT_EQ(rig.drive(0).emergency_code, 0x2310);
  EXPECT_EQ(rig.group->sentence(), "j1 is in fault: continuous over-current (0x2310)");
}

// Tries slave_io: drives not there yet
TEST(DriveFaults, ADriveThatIsNotThereIsNamed) {
  Rig rig(group_config(DriveMode::kTorque, 2));
  rig.frozen[1] = true;
  rig.command.enable = true;
  rig.run(2.0);
  EXPECT_EQ(rig.state(), DriveGroupState::kStarting);
  EXPECT_EQ(rig.group->sentence(), "j2 has not answered yet");
  EXPECT_EQ(rig.drives[0]->power(), Power::kSwitchOnDisabled);
  rig.frozen[1] = false;
  EXPECT_TRUE(rig.bring_up());
}

TEST(DriveFaults, ADriveWhoseSpeedNeverComesIsNotSwitchedOn) {
  for (const int every : {1, 10}) {
    auto config = group_config(DriveMode::kTorque, 2);
    config.timing.measure_every = every;
    Rig rig(config);
    rig.drives[0]->misbehaviour.mute_measurement = true;
    rig.command.enable = true;
    rig.run(2.0);
    EXPECT_EQ(rig.drive(0).fault, DriveFault::kMeasurementMissing);
    EXPECT_EQ(rig.group->sentence(), "j1 tells its position, but not its speed and torque");
    EXPECT_NE(rig.drives[1]->power(), Power::kEnabled);
  }
}

TEST(DriveFaults, ADriveIsReadyForPowerOnlyOnceItHasSaidItsModeAndItsSpeed) {
  for (const bool mode_is_late : {true, false}) {
    Rig rig(group_config(DriveMode::kTorque, 1));
    auto& misbehaviour = rig.drives[0]->misbehaviour;
    misbehaviour.shown_mode = mode_is_late ? 8 : 0;
    misbehaviour.mute_measurement = !mode_is_late;
    rig.command.enable = true;
    ASSERT_GE(rig.run_until([&] { return phase_is(rig, DrivePhase::kStarting); }, 2.0), 0.0);
    for (int i = 0; i < 100; ++i) {
      rig.cycle();
      ASSERT_TRUE(phase_is(rig, DrivePhase::kStarting)) << "it is said late, not wrongly";
    }
    misbehaviour = {};
    EXPECT_TRUE(rig.bring_up()) << rig.group->sentence();
  }
}

TEST(DriveFaults, ADriveWhoseFaultAResetDoesNotEndIsInFaultAgain) {
  Rig rig(group_config(DriveMode::kTorque, 1));
  ASSERT_TRUE(rig.bring_up());
  rig.drives[0]->trip(0x2310);
  ASSERT_GE(rig.run_until([&] { return phase_is(rig, DrivePhase::kFault); }, 0.1), 0.0);
  rig.drives[0]->misbehaviour.refuse_reset = true;
  rig.reset();
  ASSERT_GE(rig.run_until([&] { return phase_is(rig, DrivePhase::kResetting); }, 0.1), 0.0);
  EXPECT_GE(rig.run_until([&] { return phase_is(rig, DrivePhase::kFault); }, 1.0), 0.0) << "told in time";
  EXPECT_EQ(rig.drive(0).fault, DriveFault::kDriveFault);
}

TEST(DriveFaults, TheFirstFaultOfARowIsTheCauseThatIsTold) {
  Rig rig(group_config(DriveMode::kTorque, 1));
  ASSERT_TRUE(rig.bring_up());
  rig.drives[0]->misbehaviour.mute_pdos = true;
  ASSERT_GE(rig.run_until([&] { return phase_is(rig, DrivePhase::kFault); }, 0.5), 0.0);
  ASSERT_EQ(rig.drive(0).fault, DriveFault::kFeedbackMissing);
  rig.drives[0]->misbehaviour = {.cut_pdo_bytes = 1};
  rig.run(0.1);
  EXPECT_EQ(rig.drive(0).fault, DriveFault::kFeedbackMissing);
}

TEST(DriveFaults, SR05_AResetThatIsHeldDownEndsNoLaterFault) {
  Rig rig(group_config(DriveMode::kTorque, 1));
  ASSERT_TRUE(rig.bring_up());
  rig.command.reset = true;
  rig.run(0.1);
  rig.drives[0]->trip(0x2310);
  ASSERT_GE(rig.run_until([&] { return rig.state() == DriveGroupState::kFault; }, 0.1), 0.0);
  for (int i = 0; i < 500; ++i) {
    rig.cycle();
    ASSERT_EQ(rig.state(), DriveGroupState::kFault);
  }
}

TEST(DriveFaults, AnotherRatedTorqueThanConfiguredIsRefused) {
  auto config = group_config(DriveMode::kTorque, 1);
  config.axes[0].units.rated_current_A = 4.4;
  Rig rig(config);
  rig.run(2.0);
  EXPECT_EQ(rig.drive(0).fault, DriveFault::kSetupRefused);
  EXPECT_EQ(rig.group->sentence(),
            "j1 says 1000 (0x3E8) for object 0x6076: not the configured rated torque in mN·m (in can.drives "
            "torque_constant times rated_current, or torque_sensitivity times rated_voltage)");
}

TEST(DriveFaults, ARefusedSettingIsNamedWithItsAbortCode) {
  Rig rig(group_config(DriveMode::kTorque, 1));
  rig.drives[0]->misbehaviour.refuse_sdo = true;
  rig.run(2.0);
  EXPECT_EQ(rig.drive(0).fault, DriveFault::kSetupRefused);
  EXPECT_EQ(
      rig.group->sentence(),
      "j1 refuses object 0x6007:0: refused in the present state of the device (0x08000022); it has to stop by "
      "itself when the master is lost: update it, or use another drive");
}

TEST(DriveFaults, ADriveThatWillNotSwitchOnIsNamed) {
  Rig rig(group_config(DriveMode::kTorque, 2));
  rig.drives[0]->misbehaviour.refuse_enable = true;
  rig.command.enable = true;
  rig.run(2.0);
  EXPECT_EQ(rig.drive(0).fault, DriveFault::kEnableTimeout);
  EXPECT_NE(rig.drives[1]->power(), Power::kEnabled);
}

// Tries slave_io: its own following error
// Tries simulated_drive: it cannot follow
TEST(DriveFaults, FollowingErrorIsTheDrivesOwnFault) {
  simulated_drive::DriveOptions options;
  options.motor.load_Nm = 40.0;  // more than it can hold
  options.motor.joint.coulomb = 100.0;
  Rig rig(group_config(DriveMode::kPosition, 1), options);
  ASSERT_TRUE(rig.bring_up());
  rig.command.position[0] = -2.0;
  rig.run(2.0);
  EXPECT_EQ(rig.state(), DriveGroupState::kFault);
  EXPECT_EQ(rig.drive(0).emergency_code, 0x8611);
}

}  // namespace
}  // namespace phantom::drive_fault_test
