#include "components/master_io/devices/desk.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <fstream>
#include <thread>

#include "common/core/errors.hpp"
#include "common/teleop/tests/stop_store.hpp"
#include "components/master_io/devices/desk_decode.hpp"
#include "components/master_io/devices/desk_input.hpp"
#include "components/master_io/servo.hpp"
#include "components/master_io/tests/fixture.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::master_io {
namespace {

input_event event(unsigned type, unsigned code, int value) {
  input_event e{};
  e.type = static_cast<std::uint16_t>(type);
  e.code = static_cast<std::uint16_t>(code);
  e.value = value;
  return e;
}

TEST(Desk, TheDeadZoneIsCutOutAndTheCurveIsOddAndRisesToOne) {
  EXPECT_EQ(shaped(0.1, 0.12, 1.5), 0.0);
  EXPECT_EQ(shaped(-0.12, 0.12, 1.5), 0.0);
  EXPECT_DOUBLE_EQ(shaped(1.0, 0.12, 1.5), 1.0);
  EXPECT_DOUBLE_EQ(shaped(7.0, 0.12, 1.5), 1.0);
  double before = 0.0;
  for (double x = 0.13; x <= 1.0; x += 0.01) {
    EXPECT_GT(shaped(x, 0.12, 1.5), before);
    EXPECT_DOUBLE_EQ(shaped(-x, 0.12, 1.5), -shaped(x, 0.12, 1.5));
    before = shaped(x, 0.12, 1.5);
  }
  EXPECT_EQ(shaped(std::nan(""), 0.12, 1.5), 0.0);
}

TEST(Desk, SticksAreScaledByTheirDevicesRangeAndUpIsPositive) {
  AxisRanges ranges;
  ranges[ABS_X] = {0, 255};
  ranges[ABS_RY] = {-100, 100};
  InputDecoder decoder(ranges, true);
  decoder.take(event(EV_ABS, ABS_X, 255));
  decoder.take(event(EV_ABS, ABS_RY, -100));
  decoder.take(event(EV_ABS, ABS_Z, 50));  // a trigger, where the right stick is RX, RY
  EXPECT_THAT(decoder.state().axes, testing::ElementsAre(1.0, 0.0, 0.0, 1.0, 0.0, 0.0));
  decoder.take(event(EV_ABS, ABS_X, 100000));
  EXPECT_EQ(decoder.state().axes[0], 1.0);
}

TEST(Desk, KeysHoldUntilTheyAreReleasedAndOppositeOnesCancel) {
  InputDecoder decoder({}, true);
  decoder.take(event(EV_KEY, KEY_LEFT, 1));
  decoder.take(event(EV_KEY, KEY_LEFT, 2));  // repetition
  EXPECT_EQ(decoder.state().axes[0], -1.0);
  decoder.take(event(EV_KEY, KEY_RIGHT, 1));
  EXPECT_EQ(decoder.state().axes[0], 0.0);
  decoder.take(event(EV_KEY, KEY_LEFT, 0));
  EXPECT_EQ(decoder.state().axes[0], 1.0);
  decoder.take(event(EV_KEY, KEY_ESC, 1));
  decoder.take(event(EV_KEY, BTN_START, 1));
  decoder.take(event(EV_KEY, KEY_TAB, 1));
  EXPECT_EQ(decoder.events().stops, 1U);
  EXPECT_EQ(decoder.events().resets, 1U);
  EXPECT_EQ(decoder.state().bank, 1U);
}

TEST(Desk, GripperIsOpenedAndClosedByAPressOfAKeyOrAButton) {
  InputDecoder decoder({}, true);
  for (const unsigned code : {KEY_C, BTN_SOUTH, KEY_O, BTN_EAST, BTN_EAST})
    for (const int value : {1, 2, 2, 0})
      decoder.take(event(EV_KEY, code, value));  // pressed, repeated, released
  EXPECT_EQ(decoder.events().closes, 2U);
  EXPECT_EQ(decoder.events().opens, 3U);
  TerminalDecoder terminal;
  terminal.take("coc", 1.0);
  EXPECT_EQ(terminal.events().closes, 2U);
  EXPECT_EQ(terminal.events().opens, 1U);
  SpaceMouseDecoder space_mouse({});
  for (const unsigned code : {BTN_2, BTN_3, BTN_2})
    for (const int value : {1, 0}) space_mouse.take(event(EV_KEY, code, value), 1.0);
  EXPECT_EQ(space_mouse.events().closes, 2U);
  EXPECT_EQ(space_mouse.events().opens, 1U);
  EXPECT_EQ(space_mouse.events().stops + decoder.events().stops, 0U);
}

TEST(Desk, PerceptsAreChosenByKeysAndByTheCross) {
  const std::array<std::uint32_t, kPerceptKeys> each{1, 2, 3, 4};
  InputDecoder keys({}, true), buttons({}, true), hat({}, true);
  TerminalDecoder terminal;
  constexpr unsigned kKeys[] = {KEY_1, KEY_2, KEY_3, KEY_L};
  constexpr unsigned kButtons[] = {BTN_DPAD_LEFT, BTN_DPAD_UP, BTN_DPAD_RIGHT, BTN_DPAD_DOWN};
  constexpr std::pair<unsigned, int> kHat[] = {
      {ABS_HAT0X, -1}, {ABS_HAT0Y, -1}, {ABS_HAT0X, 1}, {ABS_HAT0Y, 1}};
  for (std::size_t k = 0; k < kPerceptKeys; ++k) {
    for (std::size_t presses = 0; presses <= k; ++presses) {
      for (const int value : {1, 2, 0}) {
        keys.take(event(EV_KEY, kKeys[k], value));
        buttons.take(event(EV_KEY, kButtons[k], value));
      }
      for (const int value : {kHat[k].second, kHat[k].second, 0})
        hat.take(event(EV_ABS, kHat[k].first, value));
      terminal.take(std::string_view("123l").substr(k, 1), 1.0);
    }
    EXPECT_TRUE(is_desk_key(static_cast<int>(kKeys[k]), false)) << "no enabling switch";
    EXPECT_TRUE(is_desk_key(static_cast<int>(kButtons[k]), false));
  }
  const DeskEvents expected{.percepts = each};
  EXPECT_EQ(keys.events(), expected);
  EXPECT_EQ(buttons.events(), expected);
  EXPECT_EQ(hat.events(), expected);
  EXPECT_EQ(terminal.events(), expected);
  EXPECT_EQ(hat.state().axes, DeskState{}.axes) << "the cross pushes nothing";
  EXPECT_TRUE(is_desk_key(KEY_C, false) && is_desk_key(BTN_2, true)) << "nor are the gripper's";
}

TEST(Desk, APressInATerminalPushesForAMoment) {
  TerminalDecoder decoder;
  decoder.take("\x1b[C", 10.0);
  decoder.take("s", 10.1);
  decoder.release_expired(10.2);
  EXPECT_THAT(decoder.state().axes, testing::ElementsAre(1.0, 0.0, 0.0, -1.0, 0.0, 0.0));
  decoder.release_expired(10.0 + TerminalDecoder::kPress_s);
  EXPECT_THAT(decoder.state().axes, testing::ElementsAre(0.0, 0.0, 0.0, -1.0, 0.0, 0.0));
  decoder.take("\x1b", 11.0);
  decoder.take(" ", 11.0);
  decoder.take("\r", 11.0);
  EXPECT_EQ(decoder.events().stops, 2U);
  EXPECT_EQ(decoder.events().resets, 1U);
}

DeskConfig three_joints() {
  DeskConfig config;
  config.banks = {{0, 1, 2, -1}};
  config.push.fill(2.0);
  config.brake.fill(4.0);
  return config;
}

// Tries master_io: the device at the desk is gone
TEST(Desk, AFullStickMovesAtPushOverBrakeAndAGoneDeviceBrakes) {
  DeskHand hand(three_joints(), 3);
  core::JointArray v{};
  v[1] = 0.5;
  DeskState stick{.axes = {0.0, 1.0, 0.0, 1.0}, .alive = true};
  EXPECT_DOUBLE_EQ(hand.step(stick, v)[1], 0.0) << "2 N·m at 0.5 rad/s against 4 N·m·s/rad";
  stick.alive = false;
  EXPECT_DOUBLE_EQ(hand.step(stick, v)[1], -2.0);
}

// The whole servo with a stick: coupled, it moves; before that, and after the device is gone, it does not.
TEST(Desk, TheStickMovesTheMasterOnlyWhileCoupledAndDragSlowsIt) {
  double speed[2];
  for (const bool drag : {false, true}) {
    Config config = shipped_config({.driver = "desk"});
    ASSERT_EQ(config.driver, Driver::kDesk);
    Inbox inbox;
    SimulatedDevice device(config, shipped_arm().home);
    teleop::MemoryStopStore stops;
    Servo servo(config, shipped_arm().home, device, inbox, 1, stops);
    servo.desk.write({.axes = {0.0, 1.0, 0.0, 0.0}, .alive = true});
    core::Nanoseconds now_ns = core::kNsPerSecond;
    MasterReport last;
    const auto run = [&](double duration_s, teleop::LinkState slave) {
      for (double t = 0; t < duration_s; t += config.period_s) {
        now_ns += core::from_seconds(config.period_s);
        SlaveSample sample;
        sample.received_ns = now_ns;
        sample.state = slave;
        sample.position = last.outputs.state == teleop::LinkState::kInit ? shipped_arm().home : last.position;
        inbox.slave.write(sample);
        DragSample felt;
        felt.received_ns = now_ns;
        felt.drag.valid = true;
        felt.drag.plus.fill(drag ? 0.2 : 0.0);
        felt.drag.minus = felt.drag.plus;
        inbox.drag.write(felt);
        const test::HeapGuard guard;
        servo.tick(config.period_s, now_ns);
        servo.outbox.read(last);
      }
    };
    run(0.5, teleop::LinkState::kReady);
    EXPECT_NEAR(last.velocity[1], 0.0, 1e-6) << "not coupled";
    run(1.5, teleop::LinkState::kCoupled);
    speed[drag] = last.velocity[1];
    servo.desk.write({});
    run(1.0, teleop::LinkState::kCoupled);
    EXPECT_NEAR(last.velocity[1], 0.0, 0.01) << "the device is gone";
  }
  EXPECT_GT(speed[false], 0.3);
  EXPECT_LT(speed[true], 0.7 * speed[false]);
}

// Tries master_io: `driver: desk`, and no device
TEST(Desk, AMissingDeviceIsNamed) {
  core::Snapshot<DeskState> state;
  const auto problem = [&](const std::string& device) -> std::string {
    DeskConfig config = three_joints();
    config.device = device;
    try {
      ManualInput input(config, state, {[] {}, [] {}, [](const std::string&) {}, [](bool) {}}, 0);
    } catch (const core::MissingError& missing) {
      return missing.what();
    }
    return "opened";
  };
  EXPECT_THAT(problem("/dev/input/event9999"), testing::HasSubstr("/dev/input/event9999"));
}

// The reading thread against a pipe in the device's place: the same bytes as from the kernel.
// Tries master_io: the device at the desk is gone
TEST(Desk, ReadsEventsAndTellsWhenTheDeviceIsGone) {
  const auto path = std::filesystem::path(testing::TempDir()) / ("desk_" + std::to_string(getpid()));
  std::filesystem::remove(path);
  ASSERT_EQ(mkfifo(path.c_str(), 0600), 0);
  core::Snapshot<DeskState> state;
  std::atomic<int> stops{0};
  std::string gripper;
  std::atomic<int> percepts{-1};
  DeskConfig config = three_joints();
  config.device = path.string();
  DeskState now;
  {
    ManualInput input(config, state,
                      {[&] { ++stops; }, [] {}, [](const std::string&) {},
                       [&](bool open) { gripper += open ? "open " : "closed "; },
                       [&](PerceptKey key) { percepts = static_cast<int>(key); }},
                      0);
    std::ofstream device(path, std::ios::binary);
    for (const auto& e : {event(EV_KEY, KEY_2, 1), event(EV_KEY, KEY_C, 1), event(EV_KEY, KEY_UP, 1),
                          event(EV_KEY, KEY_ESC, 1)})
      device.write(reinterpret_cast<const char*>(&e), sizeof e);
    device.flush();
    while (stops == 0 || !state.read(now) || now.axes[1] != 1.0) std::this_thread::yield();
    EXPECT_TRUE(now.alive);
  }
  EXPECT_EQ(gripper, "closed ");
  EXPECT_EQ(percepts, static_cast<int>(PerceptKey::kTone));
  state.read(now);
  EXPECT_FALSE(now.alive);
  std::filesystem::remove(path);
}

TEST(SpaceMouse, AxesAreRightAwayAndUpWhetherAbsoluteOrRelative) {
  AxisRanges ranges;
  for (auto& range : ranges) range = {-500, 500};
  SpaceMouseDecoder absolute(ranges);
  const std::pair<int, int> deflections[] = {
      {ABS_X, 250}, {ABS_Y, 500}, {ABS_Z, -900}, {ABS_RX, -500}, {ABS_RZ, 100}};
  for (const auto& [code, value] : deflections)
    absolute.take(event(EV_ABS, static_cast<unsigned>(code), value), 1.0);
  EXPECT_EQ(absolute.state().axes, (std::array<double, 6>{0.5, -1.0, 1.0, -1.0, 0.0, -0.2}));
  absolute.release_expired(100.0);
  EXPECT_EQ(absolute.state().axes[0], 0.5) << "it says itself when it is back in the middle";
  SpaceMouseDecoder relative(ranges);
  relative.take(event(EV_REL, REL_X, 175), 1.0);
  relative.take(event(EV_REL, REL_RY, -350), 1.05);
  EXPECT_EQ(relative.state().axes, (std::array<double, 6>{0.5, 0.0, 0.0, 0.0, 1.0, 0.0}));
  relative.release_expired(1.12);
  EXPECT_EQ(relative.state().axes, (std::array<double, 6>{0.0, 0.0, 0.0, 0.0, 1.0, 0.0}));
}

TEST(SpaceMouse, LeftButtonIsTheClutchAndRightButtonTheStop) {
  SpaceMouseDecoder decoder({});
  decoder.take(event(EV_KEY, BTN_0, 1), 0.0);
  EXPECT_TRUE(decoder.state().clutch_out);
  decoder.take(event(EV_KEY, BTN_0, 0), 0.0);
  EXPECT_FALSE(decoder.state().clutch_out);
  decoder.take(event(EV_KEY, BTN_1, 1), 0.0);
  decoder.take(event(EV_KEY, BTN_1, 0), 0.0);
  EXPECT_EQ(decoder.events().stops, 1U);
}

}  // namespace
}  // namespace phantom::master_io
