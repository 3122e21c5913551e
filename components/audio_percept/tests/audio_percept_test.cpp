#include "components/audio_percept/audio_percept.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/heap_guard.hpp"
#include "components/audio_percept/tests/test_config.hpp"

namespace phantom::audio_percept {
namespace {

constexpr core::Nanoseconds kMs = core::kNsPerMillisecond;

/// A component whose clock moves with what it renders.
struct Desk {
  AudioPercept percept{test_config()};
  Inputs inputs;
  core::Nanoseconds now_ns = 1'000'000 * kMs;
  std::array<float, kPeriodFrames> period{};

  Desk() { inputs.now_ns = now_ns; }
  void sense(double closeness, double speed_m_s, bool valid = true) {
    inputs.percept = {now_ns, valid, closeness, speed_m_s};
  }
  void link(LinkSample& end, Link state) { end = {now_ns, state}; }
  /// Peak of the last period of `duration_ms` of sound.
  double run(int duration_ms) {
    double peak = 0.0;
    for (int t = 0; t < duration_ms; t += 5) {
      now_ns += 5 * kMs;
      inputs.now_ns = now_ns;
      percept.step(inputs, period);
      peak = 0.0;
      for (float sample : period) peak = std::max(peak, std::abs(static_cast<double>(sample)));
    }
    return peak;
  }
  /// The same with a percept every 10 ms, as the topic has it.
  double run_sensing(int duration_ms, double closeness, double speed_m_s) {
    double peak = 0.0;
    for (int t = 0; t < duration_ms; t += 10) {
      sense(closeness, speed_m_s);
      peak = run(10);
    }
    return peak;
  }
};

TEST(AudioPercept, IsSilentAndCalmBeforeAnythingIsHeard) {
  Desk desk;
  EXPECT_EQ(desk.run(1000), 0.0);
  EXPECT_EQ(desk.percept.situation(), Situation::kWaiting);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kNone);
}

TEST(AudioPercept, AnInvalidPerceptAtTheStartIsNotALoss) {
  Desk desk;
  for (int i = 0; i < 50; ++i) desk.sense(0.0, 0.0, false), desk.run(10);
  EXPECT_EQ(desk.percept.situation(), Situation::kWaiting);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kNone);
}

TEST(AudioPercept, SoundsNearAnObjectEvenAtStandstillAndLouderInMotion) {
  Desk desk;
  const double rest = desk.run_sensing(200, 0.3, 0.0);
  const double slow = desk.run_sensing(200, 0.3, 0.05);
  const double fast = desk.run_sensing(200, 0.3, 0.25);
  EXPECT_GT(rest, 0.01);
  EXPECT_GT(slow, 1.5 * rest);
  EXPECT_GT(fast, 1.5 * slow);
}

TEST(AudioPercept, IsSilentInFreeSpaceHoweverFast) {
  Desk desk;
  desk.run_sensing(200, 0.5, 0.2);
  EXPECT_EQ(desk.run_sensing(300, 0.0, 1.0), 0.0);
  EXPECT_EQ(desk.percept.situation(), Situation::kFreeSpace);
}

TEST(AudioPercept, AStalePerceptFadesToTheLinkLostAlarm) {
  Desk desk;
  desk.run_sensing(300, 0.6, 0.1);
  desk.run(190);
  EXPECT_EQ(desk.percept.situation(), Situation::kSounding) << "before the time-out";
  desk.run(20);
  EXPECT_EQ(desk.percept.situation(), Situation::kStale);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kLinkLost);
  EXPECT_EQ(desk.percept.tone().gain, 0.0);
  EXPECT_EQ(desk.run(1000), 0.0) << "between the alarm's beeps nothing is left of the tone";
}

TEST(AudioPercept, APerceptThatTurnsInvalidIsStaleToo) {
  Desk desk;
  desk.run_sensing(100, 0.6, 0.1);
  desk.sense(0.6, 0.1, false);
  desk.run(5);
  EXPECT_EQ(desk.percept.situation(), Situation::kStale);
}

TEST(AudioPercept, GoesOnWhenThePerceptComesBack) {
  Desk desk;
  desk.run_sensing(100, 0.6, 0.1);
  desk.run(1000);
  EXPECT_GT(desk.run_sensing(200, 0.6, 0.1), 0.01);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kNone);
}

TEST(AudioPercept, AStopOfEitherEndPrevailsAndItsCauseIsKnown) {
  for (LinkSample Inputs::*end : {&Inputs::master, &Inputs::slave}) {
    Desk desk;
    desk.run_sensing(100, 0.6, 0.1);
    desk.link(desk.inputs.*end, Link::kStopped);
    desk.run(1000);  // the percept is stale by now, the stop counts more
    EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kStopped);
    EXPECT_FALSE(desk.percept.drive_fault());
    desk.link(desk.inputs.*end, Link::kDriveFault);
    desk.run(100);
    EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kStopped);
    EXPECT_TRUE(desk.percept.drive_fault());
  }
}

TEST(AudioPercept, ADegradedOrSilentLinkIsLost) {
  Desk desk;
  desk.link(desk.inputs.slave, Link::kDegraded);
  desk.run(5);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kLinkLost);
  desk.link(desk.inputs.slave, Link::kActive);
  desk.run(5);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kNone);
  desk.run(600);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kLinkLost);
}

TEST(AudioPercept, AnAlertSoundsForItsTimeAndNotBeyondItsEnd) {
  Desk desk;
  desk.inputs.alerts = {desk.now_ns, 1};
  desk.run_sensing(1000, 0.9, 0.1);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kUnsafeMotion);
  desk.run_sensing(600, 0.9, 0.1);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kNone) << "an alert that lasts does not sound for ever";
  desk.inputs.alerts = {desk.now_ns, 2};
  desk.run_sensing(100, 0.9, 0.1);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kUnsafeMotion);
  desk.inputs.alerts.active = 0;
  desk.run_sensing(10, 0.9, 0.1);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kNone);
}

TEST(AudioPercept, StepUsesNoHeap) {
  Desk desk;
  const test::HeapGuard guard;
  desk.inputs.alerts = {desk.now_ns, 1};
  desk.run_sensing(300, 0.6, 0.1);
  desk.run(500);
  desk.link(desk.inputs.master, Link::kStopped);
  desk.run(100);
}

}  // namespace
}  // namespace phantom::audio_percept
