// The master's own encoding against the bytes that CiA 301 and 402 prescribe, written out.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/can/cia402.hpp"
#include "common/can/drive_config.hpp"
#include "common/can/sdo_client.hpp"

namespace phantom::can {
namespace {

using Bytes = std::array<std::uint8_t, 8>;
using State = SdoClient::State;

CanFrame reply(const Bytes& data) { return {.id = 0x585, .length = 8, .data = data}; }

class Sdo : public testing::Test {
 protected:
  Bytes sent_request() {
    const auto frame = client.poll(now);
    EXPECT_TRUE(frame.has_value());
    if (!frame) return {};
    EXPECT_EQ(frame->id, 0x605U);
    EXPECT_EQ(frame->length, 8);
    return frame->data;
  }
  SdoClient client{5, core::from_seconds(0.1)};
  core::Nanoseconds now = 0;
};

TEST_F(Sdo, ExpeditedWrite) {
  const std::uint8_t value[] = {0xF4, 0x01};
  client.start_write(0x1017, 0, value, now);
  EXPECT_EQ(sent_request(), (Bytes{0x2B, 0x17, 0x10, 0x00, 0xF4, 0x01, 0, 0}));
  EXPECT_TRUE(client.on_frame(reply({0x60, 0x17, 0x10, 0}), now));
  EXPECT_EQ(client.state(), State::kDone);
}

TEST_F(Sdo, ExpeditedRead) {
  client.start_read(0x1000, 0, now);
  EXPECT_EQ(sent_request(), (Bytes{0x40, 0x00, 0x10, 0x00}));
  EXPECT_TRUE(client.on_frame(reply({0x43, 0x00, 0x10, 0x00, 0x92, 0x01, 0x02, 0x00}), now));
  ASSERT_EQ(client.data().size(), 4U);
  EXPECT_EQ(get_le(client.data(), 4), 0x00020192U);
}

TEST_F(Sdo, SegmentedRead) {
  client.start_read(0x1008, 0, now);
  sent_request();
  client.on_frame(reply({0x41, 0x08, 0x10, 0, 9, 0, 0, 0}), now);
  EXPECT_EQ(sent_request(), (Bytes{0x60}));
  client.on_frame(reply({0x00, 'P', 'h', 'a', 'n', 't', 'o', 'm'}), now);
  EXPECT_EQ(sent_request(), (Bytes{0x70}));
  client.on_frame(reply({0x1B, '0', '1'}), now);
  ASSERT_EQ(client.state(), State::kDone);
  EXPECT_EQ(std::string(client.data().begin(), client.data().end()), "Phantom01");
}

TEST_F(Sdo, SegmentedWrite) {
  const std::string text = "Phantom01";
  const std::vector<std::uint8_t> bytes(text.begin(), text.end());
  client.start_write(0x2000, 0, bytes, now);
  EXPECT_EQ(sent_request(), (Bytes{0x21, 0x00, 0x20, 0, 9}));
  client.on_frame(reply({0x60, 0x00, 0x20, 0}), now);
  EXPECT_EQ(sent_request(), (Bytes{0x00, 'P', 'h', 'a', 'n', 't', 'o', 'm'}));
  client.on_frame(reply({0x20}), now);
  EXPECT_EQ(sent_request(), (Bytes{0x1B, '0', '1'}));
  EXPECT_EQ(client.state(), State::kBusy);
  client.on_frame(reply({0x30}), now);
  EXPECT_EQ(client.state(), State::kDone);
}

TEST_F(Sdo, AbortHasWords) {
  client.start_read(0x5FFF, 1, now);
  sent_request();
  client.on_frame(reply({0x80, 0xFF, 0x5F, 1, 0x00, 0x00, 0x02, 0x06}), now);
  EXPECT_EQ(client.state(), State::kAborted);
  EXPECT_STREQ(sdo_abort_text(client.abort_code()), "no such object");
}

TEST_F(Sdo, SilenceTimesOutAndIsToldToTheDrive) {
  client.start_read(0x1000, 0, now);
  sent_request();
  now = core::from_seconds(0.101);
  EXPECT_EQ(sent_request(), (Bytes{0x80, 0x00, 0x10, 0, 0x00, 0x00, 0x04, 0x05}));
  EXPECT_EQ(client.state(), State::kTimedOut);
  EXPECT_FALSE(client.on_frame(reply({0x43, 0x00, 0x10, 0x00, 1}), now));  // too late
}

TEST_F(Sdo, AnswersToOtherQuestionsAreNotTaken) {
  client.start_read(0x1000, 0, now);
  sent_request();
  EXPECT_FALSE(client.on_frame(reply({0x43, 0x01, 0x10, 0x00, 1}), now));
  EXPECT_FALSE(client.on_frame({.id = 0x585, .length = 4, .data = {0x43, 0x00, 0x10, 0x00}}, now));
  EXPECT_EQ(client.state(), State::kBusy);
}

TEST_F(Sdo, ASegmentThatComesTwiceIsNoticed) {
  client.start_read(0x1008, 0, now);
  sent_request();
  client.on_frame(reply({0x41, 0x08, 0x10, 0, 20}), now);
  sent_request();
  client.on_frame(reply({0x00, 1, 2, 3, 4, 5, 6, 7}), now);
  sent_request();
  client.on_frame(reply({0x00, 1, 2, 3, 4, 5, 6, 7}), now);
  EXPECT_EQ(client.state(), State::kAborted);
  EXPECT_EQ(client.abort_code(), kAbortToggle);
}

// CiA 402, table of statusword bits: state by state, with the bits that do not matter set and cleared.
TEST(Cia402, StatuswordNamesTheState) {
  const struct {
    std::uint16_t word;
    PowerState state;
  } table[] = {{0x0000, PowerState::kNotReady},         {0x0040, PowerState::kSwitchOnDisabled},
               {0x0021, PowerState::kReadyToSwitchOn},  {0x0023, PowerState::kSwitchedOn},
               {0x0027, PowerState::kOperationEnabled}, {0x0007, PowerState::kQuickStopActive},
               {0x000F, PowerState::kFaultReaction},    {0x0008, PowerState::kFault}};
  for (const auto& row : table) {
    for (const int noise : {0x0000, 0xFF90, 0x1610}) {
      EXPECT_EQ(power_state(static_cast<std::uint16_t>(row.word | noise)), row.state)
          << std::hex << (row.word | noise);
    }
  }
  EXPECT_EQ(power_state(0x0060), PowerState::kSwitchOnDisabled);  // bit 5 does not matter there
  EXPECT_EQ(power_state(0x0028), PowerState::kFault);
}

TEST(Emergency, HasWords) {
  EXPECT_STREQ(emergency_text(0x2310), "continuous over-current");
  EXPECT_STREQ(emergency_text(0x2320), "current");
  EXPECT_STREQ(emergency_text(0x8611), "following error");
}

AxisConfig good_axis(int node) {
  AxisConfig axis{.name = "j", .node = node, .lower = -3, .upper = 3, .max_speed = 1, .max_torque = 5};
  axis.units = {
      .counts_per_turn = 65536, .gear_ratio = 5, .torque_constant_Nm_per_A = 0.25, .rated_current_A = 4};
  return axis;
}

TEST(AxisUnits, ConvertBothWays) {
  AxisUnits u = good_axis(1).units;
  u.sign = -1;
  u.offset = 0.5;
  EXPECT_EQ(u.position_counts(0.5), 0);
  EXPECT_EQ(u.position_counts(0.5 + 2 * M_PI), -5 * 65536);
  EXPECT_NEAR(u.position(-5 * 65536), 0.5 + 2 * M_PI, 1e-12);
  EXPECT_EQ(u.velocity_counts(M_PI), -5 * 32768);
  EXPECT_EQ(u.torque_mille(2.5), -500);  // rated 1 N·m, times 5 by the gear
  EXPECT_NEAR(u.torque(-500), 2.5, 1e-12);
  EXPECT_EQ(u.torque_mille(1e9), -32768);
  EXPECT_EQ(u.position_counts(std::nan("")), 0);
  AxisUnits spindle = good_axis(1).units;  // 10 mm lead: 1 N·m at the nut's shaft is 2π/0.01 N
  spindle.travel_per_turn = 0.01;
  EXPECT_EQ(spindle.position_counts(0.01), 5 * 65536);
  EXPECT_NEAR(spindle.torque(1000), 5 * 2 * M_PI / 0.01, 1e-9);
}

// λ in N·m/V: the joystick of the thesis has its 0.32 N·m at 3.6 V (table 3.1).
TEST(AxisUnits, AnAmplifierThatTakesAVoltageHasItsTorquePerVolt) {
  AxisUnits u{.counts_per_turn = 65536, .torque_sensitivity_Nm_per_V = 0.32 / 3.6, .rated_voltage_V = 3.6};
  EXPECT_TRUE(u.takes_voltage());
  EXPECT_NEAR(u.rated_motor_torque_Nm(), 0.32, 1e-12);
  EXPECT_EQ(u.torque_mille(0.16), 500);
  EXPECT_NEAR(u.torque(1000), 0.32, 1e-12);
  u.torque_sensitivity_Nm_per_V *= 2.0;
  EXPECT_EQ(u.torque_mille(0.16), 250);
  EXPECT_TRUE(check_units(u, "j", -1, 1));
  u.rated_voltage_V = 0.0;
  EXPECT_EQ(check_units(u, "j", -1, 1).message(),
            "j.rated_voltage_V: 0; allowed: greater than 0, at most 1000");
}

TEST(DriveConfig, EachFaultIsNamedWithValueAndWhatIsAllowed) {
  const auto refused = [](auto change) {
    DriveGroupConfig config;
    config.axes = {good_axis(1), good_axis(2)};
    EXPECT_TRUE(check(config));
    change(config);
    return check(config).message();
  };
  using C = DriveGroupConfig;
  EXPECT_EQ(refused([](C& c) { c.axes[0].units.torque_constant_Nm_per_A = 0; }),
            "j.torque_constant_Nm_per_A: 0; allowed: greater than 0, at most 1000");
  EXPECT_EQ(refused([](C& c) { c.axes[0].units.gear_ratio = std::nan(""); }),
            "j.gear_ratio: nan; allowed: greater than 0, at most 100000");
  EXPECT_EQ(refused([](C& c) { c.axes[0].units.sign = 0; }), "j.sign: 0; allowed: 1 or -1");
  EXPECT_EQ(refused([](C& c) { c.axes[1].node = 1; }),
            "j.node: 1; allowed: a node id that no other node on its bus has");
  EXPECT_EQ(refused([](C& c) { c.axes[1].node = 127; }),
            "j.node: 127; allowed: a node id that no other node on its bus has");
  EXPECT_EQ(refused([](C& c) { c.axes[1].node = 128; }), "j.node: 128; allowed: 1 to 127");
  EXPECT_EQ(refused([](C& c) { c.axes[0].bus = 1; }), "j.bus: 1; allowed: less than 1");
  EXPECT_EQ(refused([](C& c) { c.axes[0].max_speed = -std::numeric_limits<double>::infinity(); }),
            "j.max_speed: -inf; allowed: greater than 0");
  EXPECT_EQ(refused([](C& c) { c.timing.heartbeat_timeout_s = 0.03; }),
            "heartbeat_timeout_s: 0.03; allowed: 0.04 to 30");
  EXPECT_NE(refused([](C& c) { c.axes[0].units.offset = 1e6; }).find("counts; allowed: within"),
            std::string::npos);
  EXPECT_NE(refused([](C& c) { c.axes[0].max_torque = 1e6; }).find("per mille"), std::string::npos);
}

TEST(DriveConfig, ABusOverItsBudgetIsRefusedWithTheNumbers) {
  DriveGroupConfig config;
  for (int node = 1; node <= 6; ++node) config.axes.push_back(good_axis(node));
  for (AxisConfig& axis : config.axes) axis.mode = DriveMode::kPosition;
  config.timing.period_s = 0.001;
  // By hand: SYNC 55; each drive 125 (7 bytes) + 115 (6) + 135 (8) = 375; six of them: 2305 bits per ms; and
  // seven heartbeats of 65 bits in 20 ms.
  const BusLoad load = bus_load(config, 0);
  EXPECT_EQ(load.frames_per_cycle, 19);
  EXPECT_DOUBLE_EQ(load.bits_per_s, 2305e3 + 7 * 65 / 0.02);
  EXPECT_EQ(check(config).message(),
            "bus 0: 6 drives need 19 frames, 2.305 ms, in each cycle of 1 ms: "
            "2328 kbit/s with heartbeats, 232.8 % of 1000 kbit/s; allowed: at most 85 %. "
            "Use a longer period, measure_every, or more buses");
  config.bit_rates = {1e6, 1e6, 1e6};  // two drives to a bus
  for (std::size_t a = 0; a < 6; ++a) config.axes[a].bus = a / 2;
  config.timing.measure_every = 4;
  EXPECT_TRUE(check(config)) << check(config).message();
}

}  // namespace
}  // namespace phantom::can
