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
      can_problem("torque_constant_Nm_per_A: 0.25,", "torque_sensitivity_Nm_per_V: 0.1,"),
      AllOf(HasSubstr("j1_gantry.torque_sensitivity_Nm_per_V: '0.1' stands beside those of a current"),
            HasSubstr("torque_sensitivity_Nm_per_V and rated_voltage_V")));
  EXPECT_THAT(can_problem("torque_constant_Nm_per_A: 0.25, rated_current_A: 8", "rated_voltage_V: 10"),
              AllOf(HasSubstr("j1_gantry.torque_sensitivity_Nm_per_V"), HasSubstr("is missing")));
  EXPECT_THAT(
      can_problem("\"user:hot_cell_b\"", "\"user:hot_cell_a\""),
      AllOf(HasSubstr("can.buses[1].address: 'user:hot_cell_a'"), HasSubstr("allowed: each bus once")));
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

// One drive of the shipped file with more keys.
can::AxisConfig axis_with(const std::string& from, const std::string& to, std::size_t joint) {
  const auto file = changed(from, to, kCanFile);
  return load_config(file, shipped_arm().arm, shipped_arm().home).can.value().group.axes[joint];
}

TEST(CanConfig, WhatADriveWatchesByItselfIsReadInTheJointsUnits) {
  const can::AxisConfig axis =
      axis_with("node: 1, mode: torque,",
                "node: 1, mode: position, following_window_m: 0.004, following_time_s: 0.02,", 0);
  EXPECT_EQ(axis.following_window, 0.004);
  EXPECT_EQ(axis.following_time_s, 0.02);
  EXPECT_EQ(axis.limits_margin, std::nullopt);
  EXPECT_EQ(
      axis_with("node: 2, mode: torque,", "node: 2, mode: torque, limits_margin_rad: 0.03,", 1).limits_margin,
      0.03);
  EXPECT_THAT(can_problem("node: 2, mode: torque,", "node: 2, mode: torque, following_window_rad: 0.1,"),
              HasSubstr("j2_yaw.following_window: a drive in torque mode has no target to follow"));
  EXPECT_THAT(can_problem("node: 2, mode: torque,", "node: 2, mode: position, following_window_rad: -1,"),
              HasSubstr("can.drives.j2_yaw.following_window_rad: '-1' is out of range"));
  EXPECT_THAT(can_problem("node: 2, mode: torque,", "node: 2, mode: position, following_window_m: 1,"),
              HasSubstr("following_window_m"));
}

// The shipped file has it as a comment: uncommented it is valid, and its frames fit the bus.
TEST(CanConfig, TheExampleOfAnEnablingSwitchIsValid) {
  std::string text = test::text_of(kCanFile);
  const auto begin = text.find("# enabling_switch:"), end = text.find("\n\n", begin);
  ASSERT_NE(begin, std::string::npos);
  std::string example = "\n" + text.substr(begin, end - begin);
  for (std::size_t at = 0; (at = example.find("\n# ", at)) != std::string::npos;) example.erase(at + 1, 2);
  const auto config = load_config(test::new_file(text.replace(begin, end - begin, example)),
                                  shipped_arm().arm, shipped_arm().home);
  ASSERT_TRUE(config.enabling_switch.has_value());
  EXPECT_EQ(config.enabling_switch->source, runtime::EnablingSwitchConfig::Source::kDrive);
  EXPECT_EQ(config.enabling_switch->first.bit, 16);
  EXPECT_EQ(config.enabling_switch->second.bit, 17);
  for (std::size_t j = 0; j < 7; ++j) EXPECT_EQ(config.can->group.axes[j].digital_inputs, j == 3) << j;
  EXPECT_FALSE(load_config(kCanFile, shipped_arm().arm, shipped_arm().home).enabling_switch.has_value());
}

TEST(CanConfig, HomingIsReadInTheJointsUnits) {
  const std::string homing =
      "node: 1, mode: torque, homing: {method: 19, search_speed_m_s: 0.03, zero_speed_m_s: 0.01, "
      "acceleration_m_s2: 0.2, timeout_s: 20}, offset_m: ";
  const auto axis = axis_with("node: 1, mode: torque,", homing + "0.3,", 0);
  ASSERT_TRUE(axis.homing.has_value());
  EXPECT_EQ(axis.homing->method, 19);
  EXPECT_EQ(axis.homing->search_speed, 0.03);
  EXPECT_EQ(axis.homing->timeout_s, 20.0);
  EXPECT_THAT(can_problem("node: 1, mode: torque,", homing + "100,"),
              HasSubstr("j1_gantry.offset: 100; allowed: where its home is, within its range"));
  EXPECT_THAT(can_problem("node: 1, mode: torque,", "node: 1, mode: torque, homing: {method: 19},"),
              HasSubstr("homing.search_speed_m_s: is missing"));
}

TEST(CanConfig, BrakesHaveDelaysOfTheirOwn) {
  EXPECT_EQ(axis_with("node: 2, mode: torque,", "node: 2, mode: torque, brake: none,", 1).brake,
            std::nullopt);
  const auto axis =
      axis_with("node: 2, mode: torque,",
                "node: 2, mode: torque, brake: drive, brake_release_s: 0.15, brake_engage_s: 0.1,", 1);
  ASSERT_TRUE(axis.brake.has_value());
  EXPECT_EQ(axis.brake->release_s, 0.15);
  EXPECT_EQ(axis.brake->engage_s, 0.1);
  EXPECT_THAT(can_problem("node: 2, mode: torque,", "node: 2, mode: torque, brake: slave,"),
              AllOf(HasSubstr("can.drives.j2_yaw.brake"), HasSubstr("allowed: none, drive")));
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

// The shipped file's section force_observer.
std::string observer_section() {
  std::ostringstream read;
  read << std::ifstream(kCanFile).rdbuf();
  const std::string text = read.str();
  const auto begin = text.find("force_observer:  ");
  return text.substr(begin, text.find("\nlink:") - begin);
}

TEST(CanConfig, AForceSensorNeedsSomethingBehindIt) {
  EXPECT_THAT(can_problem(observer_section(), ""),
              AllOf(HasSubstr("force_sensor: 'true' has nothing behind it with drives on CAN"),
                    HasSubstr("true with a section force_torque_sensor or force_observer")));
  const auto file = changed("force_sensor: true", "force_sensor: false", kCanFile);
  EXPECT_FALSE(load_config(file, shipped_arm().arm, shipped_arm().home).force_sensor);
}

TEST(CanConfig, TheObserversModelIsThatOfTheArmOrOfSingleJoints) {
  const robot::SerialArm& arm = shipped_arm().arm;
  const Config joints = load_config(kCanFile, arm, shipped_arm().home);
  const auto& alone = joints.force_observer.value();
  EXPECT_FALSE(alone.coupled || alone.weight);
  EXPECT_EQ(alone.inertia_kg_m2[2], joints.plant.joints[2].inertia);
  EXPECT_DOUBLE_EQ(alone.threshold_Nm[1], 0.05 * arm.joints()[1].max_effort);
  EXPECT_EQ(alone.coulomb_Nm[1], joints.plant.joints[1].coulomb);
  const auto file =
      changed("  model: joints ", "  joints: {j2_yaw: {threshold: 9, coulomb: 2, viscous: 4}}\n  model: arm ",
              kCanFile);
  auto observer = load_config(file, arm, shipped_arm().home).force_observer.value();
  EXPECT_TRUE(observer.coupled);
  EXPECT_FALSE(observer.weight) << "the plant is balanced";
  EXPECT_EQ(observer.inertia_kg_m2[0], 5.0);
  EXPECT_EQ(observer.inertia_kg_m2[2], 0.3) << "of the rotor: the links' come from the URDF";
  EXPECT_EQ(observer.threshold_Nm[1], 9.0);
  EXPECT_EQ(observer.coulomb_Nm[1], 2.0);
  EXPECT_EQ(observer.viscous_Nms_per_rad[1], 4.0);
  const auto heavy = test::changed(file, "plant: ", "plant:\n  balanced: false #");
  EXPECT_TRUE(load_config(heavy, arm, shipped_arm().home).force_observer->weight);
}

TEST(CanConfig, AnObserverThatCouldNotServeIsRefused) {
  EXPECT_THAT(
      can_problem("  lag_s: 0.01 ", "  lag_s: 0.003 "),
      AllOf(HasSubstr("force_observer.lag_s: '0.003' is less than two measurements of the drives take"),
            HasSubstr("allowed: at least 0.004")));
  EXPECT_EQ(can_problem("  lag_s: 0.01 ", "  lag_s: 0.004 "), "accepted");
  EXPECT_THAT(
      can_problem("threshold_share_of_effort: 0.05", "threshold_share_of_effort: 0.01"),
      AllOf(
          HasSubstr(
              "force_observer.threshold_share_of_effort: '0.01' is not above the Coulomb friction of j1_gantry"),
          HasSubstr("allowed: more than 8")));
  EXPECT_THAT(can_problem("  model: joints ", "  joints: {j2_yaw: {threshold: 1}}\n  model: joints "),
              HasSubstr("force_observer.joints: is not above the Coulomb friction of j2_yaw"));
  EXPECT_THAT(can_problem("  model: joints ", "  model: chain "), HasSubstr("allowed: arm, joints"));
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
