#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/core/errors.hpp"
#include "components/slave_io/tests/fixture.hpp"

namespace phantom::slave_io {
namespace {

using testing::AllOf;
using testing::HasSubstr;

// What the reader says of the shipped file for drives with one piece of text replaced.
std::string can_problem(const std::string& from, const std::string& to) {
  return problem_of_changed(from, to, kCanFile);
}

TEST(CanConfig, TheShippedFileIsValid) {
  const Config config = load_config(kCanFile, shipped_arm().arm, shipped_arm().home);
  EXPECT_EQ(config.driver, Driver::kCan);
  const auto& group = config.can.value().group;
  ASSERT_EQ(group.axes.size(), shipped_arm().arm.joint_count());
  EXPECT_EQ(group.timing.period_s, config.period_s);
  for (std::size_t j = 0; j < group.axes.size(); ++j) {
    EXPECT_EQ(group.axes[j].name, shipped_arm().arm.joints()[j].name);
    EXPECT_EQ(group.axes[j].max_torque, config.gains[j].torque_limit);
    EXPECT_EQ(group.axes[j].upper, shipped_arm().arm.joints()[j].upper);
  }
  // 0.2 m of way per turn of the output, ten turns of the motor for one: 65536 · 10 ÷ 0.2 counts/m.
  EXPECT_DOUBLE_EQ(group.axes[0].units.counts_per_unit(), 3276800.0);
}

TEST(CanConfig, ASectionThatIsNotInUseIsReadAllTheSame) {
  const auto file = changed("driver: can", "driver: sim", kCanFile);
  EXPECT_THROW(load_config(file, shipped_arm().arm, shipped_arm().home), core::ConfigError)
      << "no contact section";
  EXPECT_THAT(can_problem("on_fault: hold", "on_fault: jump"),
              HasSubstr("can.on_fault: 'jump' is not known"));
}

TEST(CanConfig, FaultsOfTheDrivesAreNamedWithWhatIsAllowed) {
  EXPECT_THAT(can_problem("torque_constant_Nm_per_A: 0.25, rated_current_A: 8",
                          "torque_constant_Nm_per_A: 0, rated_current_A: 8"),
              AllOf(HasSubstr("can.drives.j1_gantry.torque_constant_Nm_per_A: '0' is out of range"),
                    HasSubstr("allowed")));
  EXPECT_THAT(can_problem("torque_constant_Nm_per_A: 0.25,", "torque_constant_Nm_per_A: .nan,"),
              HasSubstr("torque_constant_Nm_per_A: '.nan' is out of range"));
  EXPECT_THAT(
      can_problem("bus: 0, node: 2", "bus: 0, node: 1"),
      AllOf(HasSubstr("can.drives.j2_yaw.node: '1'"), HasSubstr("that of j1_gantry on the same bus")));
  EXPECT_THAT(can_problem("bus: 0, node: 2", "bus: 0, node: 127"), HasSubstr("is the master's"));
  EXPECT_THAT(can_problem("bus: 0, node: 2", "bus: 0, node: 200"), HasSubstr("allowed: 1 to 127"));
  EXPECT_THAT(can_problem("bus: 0, node: 2", "bus: 2, node: 2"), HasSubstr("can.drives.j2_yaw.bus: '2'"));
  EXPECT_THAT(
      can_problem("mode: torque", "mode: torques"),
      AllOf(HasSubstr("can.drives.j1_gantry.mode"), HasSubstr("allowed: torque, velocity, position")));
  EXPECT_THAT(can_problem("gear_ratio: 10,", "gear_ratio: -5,"),
              HasSubstr("can.drives.j1_gantry.gear_ratio: '-5'"));
  EXPECT_THAT(can_problem("gear_ratio: 10,", "gear_ratio: 10, sign: 0,"), HasSubstr("allowed: 1 or -1"));
  EXPECT_THAT(can_problem("counts_per_turn: 65536, ", ""),
              HasSubstr("j1_gantry.counts_per_turn: is missing"));
  EXPECT_THAT(can_problem("travel_per_turn_m: 0.2,", ""),
              HasSubstr("j1_gantry.travel_per_turn_m: is missing"));
  EXPECT_THAT(can_problem("    j7_tool_roll:", "    j8_tool_roll:"), HasSubstr("can.drives.j7_tool_roll"));
  EXPECT_THAT(can_problem("gear_ratio: 10,", "gear_ratio: 10, offset: 1,"),
              AllOf(HasSubstr("offset"), HasSubstr("unknown")));
  // Joint limits that do not fit into the drive's 32 bits.
  EXPECT_THAT(can_problem("bus: 0, node: 1, mode: torque, counts_per_turn: 65536",
                          "bus: 0, node: 1, mode: torque, counts_per_turn: 1e9"),
              AllOf(HasSubstr("can.drives"), HasSubstr("j1_gantry"), HasSubstr("counts")));
}

TEST(CanConfig, FaultsOfTheBusesAndTimesAreNamed) {
  EXPECT_THAT(can_problem("rate_Hz: 500 ", "rate_Hz: 1000 "),
              AllOf(HasSubstr("can.drives"), HasSubstr("bus 0: 4 drives need 13 frames"),
                    HasSubstr("% of 1000 kbit/s"), HasSubstr("at most 85 %")));
  EXPECT_THAT(can_problem("hot_cell_b\", bit_rate: 1000000", "hot_cell_b\", bit_rate: 125000"),
              AllOf(HasSubstr("bus 1: 3 drives"), HasSubstr("of 125 kbit/s")));
  EXPECT_THAT(can_problem("hot_cell_b\", bit_rate: 1000000", "hot_cell_b\", bit_rate: 5000000"),
              HasSubstr("can.buses[1].bit_rate: '5000000' is out of range"));
  EXPECT_THAT(can_problem("  heartbeat_timeout_s: 0.5", "  heartbeat_timeout_s: 0.06"),
              HasSubstr("two heartbeats"));
  EXPECT_THAT(can_problem("  measure_every: 1", "  measure_every: 0"), HasSubstr("can.measure_every: '0'"));
  EXPECT_THAT(can_problem("  load_budget: 0.85", "  load_budgets: 0.85"),
              HasSubstr("did you mean load_budget"));
}

TEST(CanConfig, LoopsThatSwingAtTheirRateAreRefused) {
  EXPECT_THAT(can_problem("rate_Hz: 500 ", "rate_Hz: 200 "),
              AllOf(HasSubstr("servo.bandwidth_Hz: '8' makes j1_gantry swing at rate_Hz 200: 12.5 ms"),
                    HasSubstr("allowed: softer loops, or rate_Hz from 389")));
  EXPECT_EQ(can_problem("rate_Hz: 500 ", "rate_Hz: 389 "), "accepted");
  EXPECT_THAT(can_problem("gravity_feed_forward: false",
                          "gravity_feed_forward: false\n  joints: {j2_yaw: {k_p: 1, k_v: 1e5}}\n#"),
              HasSubstr("servo.joints: makes j2_yaw swing"));
  // A drive that closes the loop itself does not wait for the bus.
  const auto file = changed("rate_Hz: 500 ", "rate_Hz: 200 ", kCanFile);
  std::ostringstream read;
  read << std::ifstream(file).rdbuf();
  std::string text = read.str();
  for (auto at = text.find("mode: torque"); at != std::string::npos; at = text.find("mode: torque"))
    text.replace(at, 12, "mode: position");
  std::ofstream(file) << text;
  EXPECT_NO_THROW(load_config(file, shipped_arm().arm, shipped_arm().home));
}

TEST(CanConfig, GainsThatAreNoNumbersOrCannotServeAreRefused) {
  const auto own_gains = [](const std::string& gains) {
    return "gravity_feed_forward: false\n  joints: {j2_yaw: {" + gains + "}}\n#";
  };
  EXPECT_THAT(can_problem("gravity_feed_forward: false", own_gains("k_p: .nan, k_v: 1")),
              HasSubstr("servo.joints.j2_yaw.k_p: '.nan' is out of range"));
  auto file = changed("gravity_feed_forward: false", own_gains("k_p: 10, k_v: 0"), kCanFile);
  EXPECT_NO_THROW(load_config(file, shipped_arm().arm, shipped_arm().home)) << "torque mode can do without";
}

}  // namespace
}  // namespace phantom::slave_io
