#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "common/simulation/user_bus_hub.hpp"
#include "components/slave_io/tests/wrist_section.hpp"

namespace phantom::slave_io {
namespace {

using testing::AllOf;
using testing::HasSubstr;

std::string wrist_problem(const std::string& from, const std::string& to) {
  const auto file = wrist_file(from, to);
  try {
    load_config(file, shipped_arm().arm, shipped_arm().home);
  } catch (const core::ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr(file.string() + ":"));
    return error.what();
  }
  return "accepted";
}

TEST(WristConfig, TheSectionIsReadInTheUnitsOfItsKeys) {
  const Config all = load_config(wrist_file(), shipped_arm().arm, shipped_arm().home);
  const WristSensorConfig& config = all.wrist.value();
  const teleop::WristSensorParameters& sensor = config.sensor;
  EXPECT_EQ(sensor.link, 7U);
  EXPECT_TRUE(sensor.X_LS.translation_m.isApprox(Eigen::Vector3d(0, 0, -0.03)));
  EXPECT_NEAR(sensor.X_LS.rotation(1, 0), 0.5, 1e-12);
  EXPECT_EQ(sensor.rated_N.z(), 400.0);
  EXPECT_EQ(sensor.threshold_Nm, 0.4);
  EXPECT_EQ(sensor.payload_kg, 1.2);
  EXPECT_EQ(sensor.payload_centre_m.x(), 0.01);
  EXPECT_TRUE(sensor.needs_tare);
  EXPECT_EQ(sensor.tare_s, 0.3);
  EXPECT_EQ(sensor.still[0], 0.005) << "the gantry slides";
  EXPECT_EQ(sensor.still[1], 0.01);
  EXPECT_EQ(config.address, "user:hot_cell_b");
  EXPECT_EQ(config.frames.channels[5].id, 417U);
  EXPECT_EQ(config.frames.channels[5].first, 4);
  EXPECT_EQ(config.frames.channels[5].scale, 0.001);
  ASSERT_EQ(config.frames.status.size(), 1U);
  EXPECT_EQ(config.frames.status[0].mask, 129);
  EXPECT_DOUBLE_EQ(config.frames.set_s, 0.001);
  EXPECT_DOUBLE_EQ(force_lag_s(config, all.period_s), 0.001 + 0.002 + 0.002 + 0.002);
}

TEST(WristConfig, AFrameThatIsFixedToTheLastLinkMayCarryIt) {
  const WristSensorConfig config = wrist_config("link: gripper", "link: tool");
  EXPECT_EQ(config.sensor.link, 7U);
  EXPECT_TRUE(config.sensor.X_LS.translation_m.isApprox(Eigen::Vector3d(0, 0, -0.19)));
  for (const char* link : {"link: wrist", "link: hand", "link: \"\""})
    EXPECT_THAT(
        wrist_problem("link: gripper", link),
        AllOf(HasSubstr("force_torque_sensor.link"), HasSubstr("allowed: gripper, or a link that is fixed")));
}

TEST(WristConfig, AForceSensorOnCanMayBeItAlone) {
  std::string text = test::read_text(wrist_file());
  const auto begin = text.find("force_observer:  ");
  text.erase(begin, text.find("\nforce_torque_sensor:") - begin);
  const auto file = test::new_folder() / "slave_io.yaml";
  std::ofstream(file) << text;
  const Config config = load_config(file, shipped_arm().arm, shipped_arm().home);
  EXPECT_TRUE(config.force_sensor && config.wrist && !config.force_observer);
}

TEST(WristConfig, ByTopicNoBusIsNamed) {
  EXPECT_EQ(wrist_config("source: can", "source: topic").address, "");
  const std::string section = kWristSection.substr(kWristSection.find("  can:\n"));
  const std::string frames = section.substr(0, section.find("link:"));
  EXPECT_THAT(wrist_problem(frames, ""), HasSubstr("force_torque_sensor.can: is missing"));
}

TEST(WristConfig, WhatCannotServeIsRefusedWithWhatIsAllowed) {
  EXPECT_THAT(wrist_problem("source: can", "source: bus"), HasSubstr("allowed: topic, can"));
  EXPECT_THAT(wrist_problem("rate_Hz: 500", "rate_Hz: 50"),
              HasSubstr("staleness_s: '0.02' is less than two"));
  EXPECT_THAT(wrist_problem("rated_N: [200, 200, 400]", "rated_N: [200, 3, 400]"),
              AllOf(HasSubstr("rated_N"), HasSubstr("is not above the threshold; allowed: more than 4")));
  EXPECT_THAT(wrist_problem("rated_N: [200, 200, 400]", "rated_N: [200, 200]"),
              HasSubstr("three, [x, y, z]"));
  EXPECT_THAT(wrist_problem("  rated_Nm: [20, 20, 20]\n", ""), HasSubstr("rated_Nm: is missing"));
  EXPECT_THAT(wrist_problem("threshold_N: 4", "threshold_N: 0"),
              HasSubstr("threshold_N: '0' is out of range"));
  EXPECT_THAT(wrist_problem("payload_kg: 1.2", "payload_kg: -1"),
              HasSubstr("payload_kg: '-1' is out of range"));
  EXPECT_THAT(wrist_problem("most_N: 20, ", ""), HasSubstr("tare.most_N: is missing"));
  EXPECT_THAT(wrist_problem("      force_y: {id: 416, byte: 2, scale: 0.02}\n", ""),
              HasSubstr("channels: has 5 of the six numbers"));
  EXPECT_THAT(wrist_problem("{id: 416, byte: 2, scale: 0.02}", "{id: 416, byte: 7, scale: 0.02}"),
              HasSubstr("describes force_y: a number from byte 7; allowed: 0 to 6"));
  EXPECT_THAT(wrist_problem("{id: 416, byte: 2, scale: 0.02}", "{id: 416, byte: 1, scale: 0.02}"),
              HasSubstr("force_y: a number from byte 1 of frame 416, which has that of force_x from byte 0"));
  EXPECT_THAT(wrist_problem("number: signed", "number: float"), HasSubstr("of a float 4"));
  EXPECT_THAT(wrist_problem("    bytes: 2", "    bytes: 2\n    set_s: 0.002"),
              HasSubstr("set_s: '0.002' is as long as from one wrench to the next"));
  EXPECT_THAT(wrist_problem("{id: 417, byte: 4, scale: 0.001}", "{id: 4170, byte: 4, scale: 0.001}"),
              HasSubstr("id 4170; allowed: 0 to 2047"));
}

TEST(WristConfig, OnABusOfTheDrivesItsFramesCountIntoTheLoad) {
  EXPECT_THAT(wrist_problem("rate_Hz: 500", "rate_Hz: 4000"),
              AllOf(HasSubstr("rate_Hz: '4000' makes the load of user:hot_cell_b"),
                    HasSubstr("% with its drives; allowed: at most 85")));
  EXPECT_EQ(wrist_problem("address: \"user:hot_cell_b\"\n", "address: can5\n"), "accepted");
  EXPECT_THAT(wrist_problem("{id: 417, byte: 4, scale: 0.001}", "{id: 386, byte: 4, scale: 0.001}"),
              HasSubstr("uses id 386, which is that of node 2 on user:hot_cell_b"));
}

// As --check does, on a userspace bus.
// Tries slave_io: nothing of a sensor at the wrist
TEST(WristConfig, ACheckSaysWhetherTheSensorMeasures) {
  WristSensorConfig config = wrist_config();
  config.address = "user:wrist-check-" + std::to_string(getpid());
  EXPECT_THAT(check_wrist_bus(config), HasSubstr("the bus is not there yet"));
  const auto hub = simulation::UserBusHub::serve(config.address, {.bit_rate = 1e6}).value();
  try {
    check_wrist_bus(config);
    ADD_FAILURE() << "nobody sends";
  } catch (const core::MissingError& error) {
    EXPECT_THAT(error.what(), HasSubstr("no whole measurement on " + config.address));
  }
  for (const bool good : {true, false}) {
    const auto status = static_cast<std::uint8_t>(good ? 0x80 : 0x81);
    auto sensor = can::open_bus(config.address).value();
    std::jthread sender([&](const std::stop_token& stop) {
      while (!stop.stop_requested()) {
        sensor->send({.id = 416, .length = 7, .data = {0, 0, 0, 0, 0, 0, status}});
        sensor->send({.id = 417, .length = 6});
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
    });
    EXPECT_THAT(check_wrist_bus(config), HasSubstr(good ? ": measures" : ": says that it does not measure"));
  }
}

}  // namespace
}  // namespace phantom::slave_io
