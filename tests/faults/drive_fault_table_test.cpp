// Every fault of the drives in every state of the link: the state that slave and master come to, how long
// that takes, what the operator is told, what the drives do, and that nothing jumps, neither then nor after
// the reset. The long form (thorough.hpp) leaves the table as Markdown; the quick one has two states for each
// fault.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>
#include <sstream>

#include "common/core/errors.hpp"
#include "tests/faults/table.hpp"

namespace phantom::faults {
namespace {

using can::FaultReaction;
using teleop::LinkState;
using teleop::StopCause;
using Power = simulated_drive::SimulatedDrive::Power;
constexpr std::size_t kAxis = 3;   // j4_elbow, on bus 0
constexpr std::size_t kSound = 1;  // j2_yaw: a drive without a fault of its own

struct DriveFault {
  const char* name;
  std::function<void(Pair&)> begin, end;
  std::vector<std::string> told;  ///< the operator reads one of these
  int limit_ms = 100;             ///< to be known after at most so long
  bool only_powered = false;      ///< means nothing to a drive in quick stop
  bool unreached = false;         ///< no command reaches the drives of that bus
};

simulated_drive::Misbehaviour& misbehaviour(Pair& p) { return p.rig->drives[kAxis]->misbehaviour; }
simulation::LocalBus& bus(Pair& p) { return *p.rig->buses[0]; }

const std::vector<DriveFault>& faults() {
  static const auto nothing = [](Pair&) {};
  static const std::vector<DriveFault> all{
      {"over-current in a drive",
       [](Pair& p) { p.rig->drives[kAxis]->trip(0x2310); },
       nothing,
       {"over-current (0x2310)"}},
      {"a drive's following error",
       [](Pair& p) { p.rig->drives[kAxis]->trip(0x8611); },
       nothing,
       {"following error (0x8611)"}},
      {"emergency message", [](Pair& p) { p.rig->drives[kAxis]->warn(0x4310); }, nothing, {"(0x4310)"}},
      {"a drive's heartbeat stops",
       [](Pair& p) { misbehaviour(p).mute_heartbeat = true; },
       [](Pair& p) { misbehaviour(p).mute_heartbeat = false; },
       {"its heartbeat stopped"}},
      {"a drive falls silent",
       [](Pair& p) { p.rig->frozen[kAxis] = true; },
       [](Pair& p) { p.rig->frozen[kAxis] = false; },
       {"leaves SYNCs without an answer"}},
      {"a drive's speed and torque stop coming",
       [](Pair& p) { misbehaviour(p).mute_measurement = true; },
       [](Pair& p) { misbehaviour(p).mute_measurement = false; },
       {"speed and torque"}},
      {"a drive reports another mode",
       [](Pair& p) { misbehaviour(p).shown_mode = 1; },
       [](Pair& p) { misbehaviour(p).shown_mode = 0; },
       {"reports mode of operation 1"}},
      {"a PDO of the wrong length",
       [](Pair& p) { misbehaviour(p).cut_pdo_bytes = 1; },
       [](Pair& p) { misbehaviour(p).cut_pdo_bytes = 0; },
       {"sent a PDO of"}},
      {"a node id twice on the bus",
       [](Pair& p) { p.rig->add_twin(kAxis); },
       [](Pair& p) { p.rig->remove_twin(); },
       {"shares its node id", "restarted by itself"},
       300},
      {"a drive starts anew",
       [](Pair& p) { p.rig->drives[kAxis]->power_cycle(); },
       nothing,
       {"restarted by itself"}},
      {"a power stage goes off",
       [](Pair& p) { p.rig->drives[kAxis]->cut_power(); },
       nothing,
       {"switched its power off by itself"},
       100,
       true},
      {"bus-off of our controller",
       [](Pair& p) { bus(p).set_bus_off(*p.rig->ports[0]); },
       nothing,
       {"(bus-off)"},
       100,
       false,
       true},
      {"the bus is cut",
       [](Pair& p) { bus(p).set_plugged(*p.rig->ports[0], false); },
       [](Pair& p) { bus(p).set_plugged(*p.rig->ports[0], true); },
       {"leaves SYNCs without an answer"},
       100,
       false,
       true},
  };
  return all;
}

/// Watches the arm itself, not what is told of it.
class MotionWatch {
 public:
  explicit MotionWatch(const Pair& pair) : pair_(pair) { look(); }
  void look() {
    for (std::size_t j = 0; j < kJoints; ++j) {
      const double fastest = slave_io::shipped_arm().arm.joints()[j].max_speed;
      EXPECT_LE(std::abs(pair_.rig->velocity(j)), 1.2 * fastest) << "joint " << j;
      const double dv = std::abs(pair_.rig->velocity(j) - v_[j]);
      greatest_dv_ = std::max(greatest_dv_, started_ ? dv / fastest : 0.0);
      v_[j] = pair_.rig->velocity(j);
    }
    started_ = true;
  }
  double greatest_dv() const {
    return greatest_dv_;
  }  ///< change of speed within a millisecond ÷ greatest speed

 private:
  const Pair& pair_;
  core::JointArray v_{};
  bool started_ = false;
  double greatest_dv_ = 0.0;
};

struct DriveOutcome {
  Reaction master, slave;
  StopCause cause{};
  std::string message;
  double moved_mrad = 0.0;    // of the sound drive, from the fault on
  double speed_at_end = 0.0;  // of the sound drive, before the reset, rad/s
  bool holds = false;         // its power stage
  double greatest_dv = 0.0;
};

DriveOutcome run(const DriveFault& fault, LinkState state, FaultReaction reaction) {
  Pair pair(reaction);
  bring_to(pair, state);
  if (testing::Test::HasFatalFailure()) return {};
  MotionWatch watch(pair);
  DriveOutcome out;
  out.master.reached = pair.master_state();
  out.slave.reached = pair.slave_state();
  const double before = pair.rig->position(kSound);
  fault.begin(pair);
  for (int ms = 1; ms <= 600; ++ms) {
    pair.step();
    watch.look();
    out.master.see(pair.master_state(), ms);
    out.slave.see(pair.slave_state(), ms);
  }
  EXPECT_NE(pair.master_state(), LinkState::kCoupled);
  out.cause = pair.slave_now.outputs.stop.cause;
  out.message = pair.slave_drives().message;
  out.moved_mrad = 1e3 * std::abs(pair.rig->position(kSound) - before);
  out.speed_at_end = std::abs(pair.rig->velocity(kSound));
  out.holds = pair.rig->drives[kSound]->power() == Power::kQuickStop;
  fault.end(pair);
  for (int ms = 0; ms < 300;
       ++ms) {  // what had piled up goes over the bus, and nothing follows without a reset
    pair.step();
    watch.look();
  }
  pair.reset();
  const auto coupled = [&] {
    return pair.master_state() == LinkState::kCoupled && pair.slave_state() == LinkState::kCoupled;
  };
  pair.step();
  for (int ms = 0; ms < 12000 && !coupled(); ++ms) {
    pair.step();
    watch.look();
  }
  EXPECT_TRUE(coupled()) << "it comes back after the reset: " << pair.slave_drives().message;
  out.greatest_dv = watch.greatest_dv();
  return out;
}

// Gravest first: what may never be, and what must be.
void assess(const DriveFault& fault, LinkState state, FaultReaction reaction, const DriveOutcome& out) {
  // 20 rad/s² is the drives' quick stop, 150 that of the gantry's; a jump would be the greatest speed at
  // once.
  EXPECT_LT(out.greatest_dv, 0.2);
  const bool found = !(fault.only_powered && state == LinkState::kStopped);
  if (found) {
    EXPECT_THAT(fault.told,
                testing::Contains(testing::ResultOf(
                    [&](const std::string& words) { return out.message.find(words) != std::string::npos; },
                    testing::IsTrue())))
        << out.message;
    EXPECT_EQ(out.slave.reached, LinkState::kStopped);
    EXPECT_EQ(out.cause,
              StopCause::kDriveFault);  // of several causes the gravest; the other side's is the last
    if (state != LinkState::kStopped) {
      ASSERT_TRUE(out.slave.after_ms.has_value());
      EXPECT_LE(*out.slave.after_ms, fault.limit_ms);
    }
  }
  if (found && state != LinkState::kInit) {
    EXPECT_EQ(out.master.reached, LinkState::kStopped) << "a slave in fault stops the master";
  }
  if (reaction == FaultReaction::kHold) {
    EXPECT_TRUE(out.holds);
    EXPECT_LT(out.speed_at_end, 1e-3);
    EXPECT_LT(out.moved_mrad, 60.0);
  } else if (found) {
    // A drive that was in quick stop already, and that nobody reaches, goes on holding.
    EXPECT_EQ(out.holds, fault.unreached && state == LinkState::kStopped);
  }
}

std::string row(const DriveFault& fault, LinkState state, const DriveOutcome& out) {
  std::ostringstream line;
  line << "| " << fault.name << " | " << name_of(state) << " | " << text(out.slave) << " | "
       << text(out.master) << " | " << name_of(out.cause) << " | " << out.message << " | "
       << std::round(10.0 * out.moved_mrad) / 10.0 << " |\n";
  return line.str();
}

class DriveFaultTable : public testing::TestWithParam<FaultReaction> {};

// Tries slave_io: a drive in fault … bus-off
TEST_P(DriveFaultTable, SR05_SR10_EveryFaultInEveryStateIsNamedAndHeldOrCoastedWithoutAJump) {
  const bool hold = GetParam() == FaultReaction::kHold;
  std::ostringstream table;
  table << "Drives on CAN at 500 Hz, reaction " << (hold ? "hold" : "coast")
        << ": the fault is one drive's (or its bus's); "
           "how far a sound drive went on within 0.6 s is in the last column.\n\n"
        << "| fault | master was | slave | master | cause | told | mrad |\n|---|---|---|---|---|---|---|\n";
  for (std::size_t number = 0; number < faults().size(); ++number) {
    const DriveFault& fault = faults()[number];
    for (const auto& [side, state] : beginnings(number, {Side::kMaster})) {
      SCOPED_TRACE(std::string(fault.name) + ", master " + name_of(state));
      const DriveOutcome out = run(fault, state, GetParam());
      assess(fault, state, GetParam(), out);
      table << row(fault, state, out);
      ASSERT_FALSE(testing::Test::HasFailure());
    }
  }
  if (!test::thorough()) return;
  std::ofstream(std::string(PHANTOM_REPORT_DIR) +
                (hold ? "/fault_table_drives_hold.md" : "/fault_table_drives_coast.md"))
      << table.str();
}

INSTANTIATE_TEST_SUITE_P(Reactions, DriveFaultTable,
                         testing::Values(FaultReaction::kHold, FaultReaction::kCoast), [](const auto& made) {
                           return made.param == FaultReaction::kHold ? "Hold" : "Coast";
                         });

// A process that dies leaves the drives to themselves; a new one finds the arm where it is.
// Tries slave_io: slave_io dies
TEST(DriveFaults, DrivesWhoseSlaveIoDiesHoldByThemselvesAndItsSuccessorCouplesAfresh) {
  Pair pair(FaultReaction::kHold);
  bring_to(pair, LinkState::kCoupled);
  pair.slave_life = Life::kGone;
  for (int ms = 0; ms < 300; ++ms) pair.step();
  for (const auto& drive : pair.rig->drives) EXPECT_EQ(drive->power(), Power::kQuickStop);
  EXPECT_EQ(pair.master_state(), LinkState::kDegraded);
  for (int ms = 0; ms < 400; ++ms) pair.step();
  pair.start_slave();
  MotionWatch watch(pair);
  for (int ms = 0; ms < 12000 && pair.slave_state() != LinkState::kCoupled; ++ms) {
    pair.step();
    watch.look();
  }
  EXPECT_EQ(pair.slave_state(), LinkState::kCoupled) << pair.slave_drives().message;
  EXPECT_LT(watch.greatest_dv(), 0.2);
}

// What would make a drive jump at the first command is refused before there is one.
TEST(DriveFaults, ConfigurationsThatCannotServeAreRefusedByFileLineAndKey) {
  struct Case {
    const char *name, *from, *to, *words;
  };
  const Case cases[] = {
      {"torque constant 0", "torque_constant_Nm_per_A: 0.25, rated_current_A: 8",
       "torque_constant_Nm_per_A: 0, rated_current_A: 8", "torque_constant_Nm_per_A: '0' is out of range"},
      {"torque constant NaN", "torque_constant_Nm_per_A: 0.25,", "torque_constant_Nm_per_A: .nan,",
       "'.nan' is out of range"},
      {"gains that are NaN", "gravity_feed_forward: false",
       "gravity_feed_forward: false\n  joints: {j2_yaw: {k_p: .nan, k_v: 1}}\n#",
       "servo.joints.j2_yaw.k_p: '.nan' is out of range"},
      {"bandwidth that is NaN", "bandwidth_Hz: 8", "bandwidth_Hz: .nan",
       "bandwidth_Hz: '.nan' is out of range"},
      {"a node id twice", "bus: 0, node: 2", "bus: 0, node: 1", "that of j1_gantry on the same bus"},
      {"a bus over its budget", "rate_Hz: 500 ", "rate_Hz: 1000 ", "at most 85 %"},
  };
  std::ofstream table(std::string(PHANTOM_REPORT_DIR) + "/fault_table_refused.md");
  table
      << "Refused at the start (exit code 2), before any drive is spoken to.\n\n| fault | told |\n|---|---|\n";
  for (const Case& c : cases) {
    const auto file = slave_io::changed(c.from, c.to, slave_io::kCanFile);
    try {
      slave_io::load_config(file, slave_io::shipped_arm().arm, slave_io::shipped_arm().home);
      FAIL() << c.name << " was accepted";
    } catch (const core::ConfigError& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr(c.words)) << c.name;
      std::string told = error.what();
      told.replace(0, file.parent_path().string().size() + 1, "");
      table << "| " << c.name << " | " << told << " |\n";
    }
  }
}

}  // namespace
}  // namespace phantom::faults
