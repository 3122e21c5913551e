#include "components/audio_percept/audio_percept.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "components/audio_percept/tests/test_config.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::audio_percept {
namespace {

/// A component whose clock moves with what it renders.
struct Desk {
  AudioPercept percept{test_config()};
  Inputs inputs;
  core::Nanoseconds now_ns = 1'000'000 * core::kNsPerMillisecond;
  Model model = Model::kSound;
  std::array<float, kPeriodFrames> tone{}, alarm{};

  Desk() { inputs.now_ns = now_ns; }
  void sense(double closeness, double speed_m_s, bool valid = true) {
    inputs.percept = {.received_ns = now_ns,
                      .valid = valid,
                      .closeness = closeness,
                      .speed_m_s = speed_m_s,
                      .model = model};
  }
  void link(LinkSample& end, Link state) { end = {now_ns, state}; }
  /// Peak of the last period of `duration_ms` of sound.
  double run(int duration_ms) {
    double peak = 0.0;
    for (int t = 0; t < duration_ms; t += 5) {
      now_ns += 5 * core::kNsPerMillisecond;
      inputs.now_ns = now_ns;
      percept.step(inputs, tone, alarm);
      peak = 0.0;
      for (std::size_t i = 0; i < tone.size(); ++i)
        peak = std::max(peak, std::abs(static_cast<double>(tone[i]) + static_cast<double>(alarm[i])));
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
  EXPECT_EQ(desk.percept.tone().gain, 0.0);
  desk.run(120);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kLinkLost);
  EXPECT_EQ(desk.percept.sounding(), percept::Alarm::kLinkLost);
  EXPECT_EQ(desk.run(3000), 0.0) << "after the alarm's burst nothing is left of the tone";
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kLinkLost) << "it stands, though it is silent for a while";
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
    EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kEmergencyStop);
    desk.link(desk.inputs.*end, Link::kDriveFault);
    desk.run(100);
    EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kDriveFault);
    EXPECT_EQ(desk.percept.sounding(), percept::Alarm::kDriveFault);
  }
}

TEST(AudioPercept, ADegradedOrSilentLinkIsLost) {
  Desk desk;
  desk.link(desk.inputs.slave, Link::kDegraded);
  desk.run(120);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kLinkLost);
  desk.link(desk.inputs.slave, Link::kActive);
  desk.run(5);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kNone);
  desk.run(450);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kNone) << "before the time-out";
  desk.run(170);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kLinkLost);
}

TEST(AudioPercept, AWorkspaceThatCannotBeReliedOnHasItsOwnAlarm) {
  Desk desk;
  desk.run_sensing(100, 0.6, 0.1);
  desk.model = Model::kStale;
  for (int i = 0; i < 30; ++i) desk.sense(0.0, 0.0, false), desk.run(10);
  EXPECT_EQ(desk.percept.situation(), Situation::kStale);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kWorkspaceStale);
  desk.run(500);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kLinkLost) << "now the phantom is silent altogether";
}

TEST(AudioPercept, AFailedSelfTestSoundsEvenAtTheStartAMissingWorkspaceDoesNot) {
  for (const Model model : {Model::kStale, Model::kNoState, Model::kTestFailed}) {
    Desk desk;
    desk.model = model;
    for (int i = 0; i < 30; ++i) desk.sense(0.0, 0.0, false), desk.run(10);
    EXPECT_EQ(desk.percept.alarm(),
              model == Model::kTestFailed ? percept::Alarm::kWorkspaceStale : percept::Alarm::kNone);
  }
}

TEST(AudioPercept, AnAgedWorkspaceIsSaidWhileThePerceptGoesOn) {
  Desk desk;
  desk.model = Model::kAged;
  desk.run_sensing(1500, 0.6, 0.1);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kWorkspaceAged);
  EXPECT_EQ(desk.percept.situation(), Situation::kSounding);
  EXPECT_GT(desk.percept.tone().gain, 0.0);
  EXPECT_EQ(desk.percept.bursts(), 1U);
}

TEST(AudioPercept, AMutedContactIsSaidOnce) {
  Desk desk;
  for (int i = 0; i < 6000; ++i) {
    desk.sense(0.0, 0.1);
    desk.inputs.percept.muted = true;
    desk.run(10);
  }
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kMutedContact);
  EXPECT_EQ(desk.percept.bursts(), 1U);
}

TEST(AudioPercept, AResetByTheOperatorMakesWhatStandsRare) {
  Desk desk;
  desk.link(desk.inputs.slave, Link::kStopped);
  desk.run(1000);
  desk.inputs.command.reset_ns = desk.now_ns;
  for (int i = 0; i < 280; ++i) desk.link(desk.inputs.slave, Link::kStopped), desk.run(100);
  EXPECT_EQ(desk.percept.bursts(), 1U);
  for (int i = 0; i < 20; ++i) desk.link(desk.inputs.slave, Link::kStopped), desk.run(100);
  EXPECT_EQ(desk.percept.bursts(), 2U);
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
  EXPECT_EQ(desk.percept.sounding(), percept::Alarm::kUnsafeMotion);
  desk.inputs.alerts.active = 0;
  desk.run_sensing(10, 0.9, 0.1);
  EXPECT_EQ(desk.percept.alarm(), percept::Alarm::kNone);
  EXPECT_EQ(desk.percept.sounding(), percept::Alarm::kNone);
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
