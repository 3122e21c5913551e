#include "common/runtime/servo/enabling_switch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/input-event-codes.h>

#include <string>

#include "tests/support/heap_guard.hpp"

namespace phantom::runtime {
namespace {

using teleop::SwitchState;
using testing::HasSubstr;
using Source = EnablingSwitchConfig::Source;

constexpr double kTick_s = 0.001;
constexpr core::Nanoseconds kTick_ns = 1'000'000;

std::optional<DrivesConfig> two_drives() {
  DrivesConfig drives;
  drives.addresses = {"user:a"};
  for (const char* name : {"j1", "j2"}) {
    can::AxisConfig axis{.name = name, .node = static_cast<int>(1 + drives.group.axes.size())};
    axis.units = {
        .counts_per_turn = 65536, .gear_ratio = 5, .torque_constant_Nm_per_A = 0.5, .rated_current_A = 4};
    axis.lower = -1.0, axis.upper = 1.0, axis.max_speed = 1.0, axis.max_torque = 1.0;
    drives.group.axes.push_back(axis);
  }
  return drives;
}

std::optional<EnablingSwitchConfig> read(const std::string& section, std::optional<DrivesConfig>& can) {
  const auto file = Fields::from_text("enabling_switch: {" + section + "}", "a.yaml", {kSwitchParameters});
  const auto config = read_enabling_switch(file, can);
  file.finish();
  return config;
}
EnablingSwitchConfig wired(const std::string& more) {
  auto can = two_drives();
  return read("source: drive, drive: j2" + more, can).value();
}
std::string problem_of(const std::string& section, bool with_drives = true) {
  auto can = with_drives ? two_drives() : std::nullopt;
  try {
    read(section, can);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(EnablingSwitchConfig, WithoutTheSectionNoneIsFitted) {
  auto can = two_drives();
  const auto file = Fields::from_text("{}", "a.yaml", {kSwitchParameters});
  EXPECT_FALSE(read_enabling_switch(file, can).has_value());
  SwitchReader reader(std::nullopt);
  EXPECT_EQ(reader.step({}, 1, kTick_s), SwitchState::kNotFitted);
}

TEST(EnablingSwitchConfig, OnlyTheDriveThatItIsWiredToSendsItsInputsAndTheBusIsPlannedWithThem) {
  auto can = two_drives();
  const double before = can::bus_load(can->group, 0).bits_per_s;
  read("source: drive, drive: j2, bit: 4", can);
  EXPECT_FALSE(can->group.axes[0].digital_inputs);
  EXPECT_TRUE(can->group.axes[1].digital_inputs);
  EXPECT_GT(can::bus_load(can->group, 0).bits_per_s, before + 4 * 8 / can->group.timing.period_s);
  can->group.load_budget = can::bus_load(can->group, 0).share - 0.001;
  can->group.axes[1].digital_inputs = false;
  try {
    read("source: drive, drive: j2", can);
    FAIL() << "accepted";
  } catch (const ConfigError& error) {
    EXPECT_THAT(error.what(), HasSubstr("allowed: at most"));
  }
}

TEST(EnablingSwitchConfig, RefusesWhatCannotBe) {
  EXPECT_EQ(problem_of("source: drive, drive: j1, bit: 3, second_bit: 5, through_bit: 6"), "accepted");
  EXPECT_THAT(problem_of("source: drive, drive: j3"), HasSubstr("allowed: j1, j2"));
  EXPECT_THAT(problem_of("source: drive, drive: j1", false), HasSubstr("needs drives on CAN"));
  EXPECT_THAT(problem_of("source: drive, drive: j1, bit: 3, second_bit: 3"), HasSubstr("first contact"));
  EXPECT_THAT(problem_of("source: drive, drive: j1, second_bit: 4, through_bit: 4"),
              HasSubstr("another contact"));
  EXPECT_THAT(problem_of("source: drive, drive: j1, second_contact: normally_closed"),
              HasSubstr("second_bit"));
  EXPECT_THAT(problem_of("source: input, key: BTN_NONE"), HasSubstr("BTN_THUMBR"));
  EXPECT_THAT(problem_of("source: input, key: KEY_A, through_key: KEY_A"), HasSubstr("another one"));
  EXPECT_THAT(problem_of("source: telepathy"), HasSubstr("input, drive, simulated"));
  EXPECT_THAT(problem_of("key: KEY_A"), HasSubstr("source"));
  EXPECT_EQ(key_code("BTN_THUMBR"), BTN_THUMBR);
  EXPECT_EQ(key_code("0x121"), 0x121);
  for (const char* none : {"", "0", "-3", "70000", "KEY_", "12x"}) EXPECT_EQ(key_code(none), -1) << none;
}

// One switch with its clock.
struct Rig {
  explicit Rig(const EnablingSwitchConfig& config) : reader(config) {}
  SwitchState run(double duration_s, std::uint32_t bits, bool answers = true) {
    SwitchState state{};
    for (double t = 0; t < duration_s; t += kTick_s) {
      now_ns += kTick_ns;
      if (answers) inputs = {bits, now_ns};
      const test::HeapGuard guard;
      state = reader.step(inputs, now_ns, kTick_s);
    }
    return state;
  }
  SwitchReader reader;
  can::DigitalInputs inputs;
  core::Nanoseconds now_ns = core::kNsPerSecond;
};

TEST(SwitchOnADrive, SR19_EveryKindOfContactIsReadFromItsBit) {
  constexpr std::uint32_t kOthers = 0xA5A40000;
  for (const bool first_closed : {false, true}) {
    for (const bool second_closed : {false, true}) {
      for (const bool through_closed : {false, true}) {
        const auto kind = [](bool closed) { return closed ? "normally_closed" : "normally_open"; };
        Rig rig(wired(std::string(", bit: 0, contact: ") + kind(first_closed) +
                      ", second_bit: 5, second_contact: " + kind(second_closed) +
                      ", through_bit: 31, through_contact: " + kind(through_closed)));
        const auto bits = [&](bool first, bool second, bool through) {
          return (kOthers & 0x7FFFFFFF) | (first != first_closed ? 1U : 0U) |
                 (second != second_closed ? 1U << 5 : 0U) | (through != through_closed ? 1U << 31 : 0U);
        };
        EXPECT_EQ(rig.run(0.1, bits(false, false, false)), SwitchState::kReleased);
        EXPECT_EQ(rig.run(0.1, bits(true, true, false)), SwitchState::kHeld);
        EXPECT_EQ(rig.run(0.001, bits(true, true, true)), SwitchState::kPressedThrough);
        rig.run(0.1, bits(false, false, false));
        rig.run(0.1, bits(true, true, false));
        EXPECT_FALSE(teleop::permits(rig.run(0.001, bits(true, false, false))));
        EXPECT_EQ(rig.run(0.6, bits(true, false, false)), SwitchState::kContactsDiffer);
      }
    }
  }
}

TEST(SwitchOnADrive, SR19_OneContactIsEnoughIfNoSecondIsNamedAndASilentDriveIsNoSwitch) {
  Rig rig(wired(", bit: 3, stale_s: 0.05"));
  EXPECT_EQ(rig.run(0.1, 8, false), SwitchState::kAbsent) << "its inputs were never received";
  rig.run(0.1, 0);
  ASSERT_EQ(rig.run(0.1, 8), SwitchState::kHeld);
  EXPECT_EQ(rig.run(0.049, 8, false), SwitchState::kHeld);
  EXPECT_EQ(rig.run(0.003, 8, false), SwitchState::kAbsent);
  EXPECT_EQ(rig.run(0.1, 8), SwitchState::kToBeReleased);
}

TEST(SwitchOnAnInputDevice, SR19_IsAsOldAsItsDeviceWasReadAndAShortReleaseBetweenTwoTicksCounts) {
  auto can = two_drives();
  Rig rig(read("source: input", can).value());
  const auto run = [&rig](double duration_s, SwitchReading reading, bool reads) {
    SwitchState state{};
    for (double t = 0; t < duration_s; t += kTick_s) {
      reading.at_ns = rig.now_ns;
      if (reads) rig.reader.input.write(reading);
      state = rig.run(kTick_s / 2, 0);
    }
    return state;
  };
  SwitchReading reading{.contacts = {.read = true}};
  EXPECT_EQ(rig.run(0.01, 0), SwitchState::kAbsent) << "before the device was read";
  EXPECT_EQ(run(0.1, reading, true), SwitchState::kReleased);
  reading.contacts.first = reading.contacts.second = true;
  EXPECT_EQ(run(0.1, reading, true), SwitchState::kHeld);
  EXPECT_EQ(run(0.09, reading, false), SwitchState::kHeld);
  EXPECT_EQ(run(0.02, reading, false), SwitchState::kAbsent) << "the thread that reads it hangs";
  reading.contacts.first = reading.contacts.second = false;
  run(0.1, reading, true);
  reading.contacts.first = reading.contacts.second = true;
  ASSERT_EQ(run(0.1, reading, true), SwitchState::kHeld);
  ++reading.let_go;
  EXPECT_FALSE(teleop::permits(run(0.0005, reading, true)));
  EXPECT_EQ(run(0.1, reading, true), SwitchState::kToBeReleased);
}

TEST(SimulatedSwitch, IsHeldByItsScript) {
  auto can = two_drives();
  Rig rig(read("source: simulated, hold_from_s: 0.3, let_go_s: [1, 2], let_go_for_s: 0.5", can).value());
  EXPECT_EQ(rig.run(0.29, 0), SwitchState::kReleased);
  EXPECT_EQ(rig.run(0.66, 0), SwitchState::kHeld);     // 0.95 s
  EXPECT_EQ(rig.run(0.5, 0), SwitchState::kReleased);  // 1.45 s
  EXPECT_EQ(rig.run(0.5, 0), SwitchState::kHeld);      // 1.95 s
  EXPECT_EQ(rig.run(0.5, 0), SwitchState::kReleased);  // 2.45 s
  EXPECT_EQ(rig.run(10.0, 0), SwitchState::kHeld);
}

}  // namespace
}  // namespace phantom::runtime
