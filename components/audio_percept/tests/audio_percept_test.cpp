#include "components/audio_percept/audio_percept.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "components/audio_percept/tests/test_config.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::audio_percept {
namespace {

using messages::PerceptCondition;
using teleop::LinkState;
using teleop::StopCause;

/// A component whose clock moves with what it renders.
struct PerceptRig {
  AudioPercept percept{test_config()};
  Inputs inputs;
  core::Nanoseconds now_ns = 1'000'000 * core::kNsPerMillisecond;
  PerceptCondition model = PerceptCondition::kFresh;
  std::array<float, kPeriodFrames> tone{}, alarm{};

  PerceptRig() { inputs.now_ns = now_ns; }
  void sense(double closeness, double speed_m_s, bool valid = true) {
    inputs.percept = {{.valid = valid, .condition = model, .closeness = closeness, .speed_m_s = speed_m_s},
                      now_ns};
  }
  void link(auto& end, LinkState state, StopCause cause = StopCause::kEmergency) {
    end.received_ns = now_ns;
    end.state = state;
    end.stop.cause = cause;
  }
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

// Tries audio_percept: no percept yet
TEST(AudioPercept, IsSilentAndCalmBeforeAnythingIsHeard) {
  PerceptRig rig;
  EXPECT_EQ(rig.run(1000), 0.0);
  EXPECT_EQ(rig.percept.situation(), Situation::kWaiting);
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kNone);
}

TEST(AudioPercept, AnInvalidPerceptAtTheStartIsNotALoss) {
  PerceptRig rig;
  for (int i = 0; i < 50; ++i) rig.sense(0.0, 0.0, false), rig.run(10);
  EXPECT_EQ(rig.percept.situation(), Situation::kWaiting);
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kNone);
}

TEST(AudioPercept, SoundsNearAnObjectEvenAtStandstillAndLouderInMotion) {
  PerceptRig rig;
  const double rest = rig.run_sensing(200, 0.3, 0.0);
  const double slow = rig.run_sensing(200, 0.3, 0.05);
  const double fast = rig.run_sensing(200, 0.3, 0.25);
  EXPECT_GT(rest, 0.01);
  EXPECT_GT(slow, 1.5 * rest);
  EXPECT_GT(fast, 1.5 * slow);
}

TEST(AudioPercept, IsSilentInFreeSpaceHoweverFast) {
  PerceptRig rig;
  rig.run_sensing(200, 0.5, 0.2);
  EXPECT_EQ(rig.run_sensing(300, 0.0, 1.0), 0.0);
  EXPECT_EQ(rig.percept.situation(), Situation::kFreeSpace);
}

TEST(AudioPercept, WithoutTheToneNothingOfItIsHeardAndAlarmsAre) {
  PerceptRig rig;
  rig.run_sensing(200, 0.5, 0.2);
  const auto master = [&](bool tone) {
    rig.link(rig.inputs.master, LinkState::kCoupled);
    rig.inputs.master.tone_enabled = tone;
  };
  master(false);
  EXPECT_EQ(rig.run_sensing(300, 0.5, 0.2), 0.0);
  EXPECT_EQ(rig.percept.situation(), Situation::kOff);
  rig.inputs.alerts = {rig.now_ns, 1};
  master(false);
  rig.run_sensing(100, 0.5, 0.2);
  EXPECT_EQ(rig.percept.sounding(), percept::Alarm::kUnsafeMotion) << "a hit threatens";
  rig.inputs.alerts.active = 0;
  rig.run(400);
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kLinkLost) << "a percept that is lost is told as ever";
  master(true);
  EXPECT_GT(rig.run_sensing(200, 0.5, 0.2), 0.01);
}

// Tries audio_percept: the master is not heard any more
TEST(AudioPercept, TheToneIsOffOnlyWhileAMasterIsHeardThatSaysSo) {
  PerceptRig rig;
  EXPECT_GT(rig.run_sensing(200, 0.5, 0.2), 0.01) << "no master";
  rig.link(rig.inputs.master, LinkState::kCoupled);
  rig.inputs.master.tone_enabled = false;
  rig.run_sensing(490, 0.5, 0.2);
  EXPECT_EQ(rig.percept.situation(), Situation::kOff);
  rig.run_sensing(30, 0.5, 0.2);
  EXPECT_EQ(rig.percept.situation(), Situation::kSounding) << "the master was last heard half a second ago";
}

// Tries audio_percept: percept stale (200 ms)
TEST(AudioPercept, AStalePerceptFadesToTheLinkLostAlarm) {
  PerceptRig rig;
  rig.run_sensing(300, 0.6, 0.1);
  rig.run(190);
  EXPECT_EQ(rig.percept.situation(), Situation::kSounding) << "before the time-out";
  rig.run(20);
  EXPECT_EQ(rig.percept.situation(), Situation::kStale);
  EXPECT_EQ(rig.percept.tone().gain, 0.0);
  rig.run(40);  // stale for 50 ms at most
  EXPECT_LT(*std::max_element(rig.tone.begin(), rig.tone.end()), 2e-4F) << "of 0.2: 60 dB less";
  rig.run(120);
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kLinkLost);
  EXPECT_EQ(rig.percept.sounding(), percept::Alarm::kLinkLost);
  EXPECT_EQ(rig.run(3000), 0.0) << "after the alarm's burst nothing is left of the tone";
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kLinkLost) << "it stands, though it is silent for a while";
}

// Tries audio_percept: not valid any more
TEST(AudioPercept, APerceptThatTurnsInvalidIsStaleToo) {
  PerceptRig rig;
  rig.run_sensing(100, 0.6, 0.1);
  rig.sense(0.6, 0.1, false);
  rig.run(5);
  EXPECT_EQ(rig.percept.situation(), Situation::kStale);
}

// Tries audio_percept: percept stale (200 ms)
TEST(AudioPercept, GoesOnWhenThePerceptComesBack) {
  PerceptRig rig;
  rig.run_sensing(100, 0.6, 0.1);
  rig.run(1000);
  EXPECT_GT(rig.run_sensing(200, 0.6, 0.1), 0.01);
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kNone);
}

/// Calls `test` with each of the two members of Inputs that report a link's state.
void for_each_end(const auto& test) {
  test(&Inputs::master);
  test(&Inputs::slave);
}

// Tries audio_percept: emergency stop … drives in fault
TEST(AudioPercept, AStopOfEitherEndPrevailsAndItsCauseIsKnown) {
  for_each_end([](auto end) {
    PerceptRig rig;
    rig.run_sensing(100, 0.6, 0.1);
    rig.link(rig.inputs.*end, LinkState::kStopped);
    rig.run(1000);  // the percept is stale by now, the stop counts more
    EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kEmergencyStop);
    rig.link(rig.inputs.*end, LinkState::kStopped, StopCause::kDriveFault);
    rig.run(100);
    EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kDriveFault);
    EXPECT_EQ(rig.percept.sounding(), percept::Alarm::kDriveFault);
  });
}

// Tries audio_percept: master or slave degraded … 500 ms
TEST(AudioPercept, ADegradedOrSilentLinkIsLost) {
  for_each_end([](auto end) {
    PerceptRig rig;
    rig.link(rig.inputs.*end, LinkState::kDegraded);
    rig.run_sensing(120, 0.6, 0.1);
    EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kLinkLost);
    EXPECT_GT(rig.percept.tone().gain, 0.0) << "over the percept";
    rig.link(rig.inputs.*end, LinkState::kCoupled);
    rig.run_sensing(10, 0.6, 0.1);
    EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kNone);
    rig.run_sensing(450, 0.6, 0.1);
    EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kNone) << "before the time-out";
    rig.run_sensing(170, 0.6, 0.1);
    EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kLinkLost);
  });
}

TEST(AudioPercept, AWorkspaceThatCannotBeReliedOnHasItsOwnAlarm) {
  PerceptRig rig;
  rig.run_sensing(100, 0.6, 0.1);
  rig.model = PerceptCondition::kWorkspaceStale;
  for (int i = 0; i < 30; ++i) rig.sense(0.0, 0.0, false), rig.run(10);
  EXPECT_EQ(rig.percept.situation(), Situation::kStale);
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kWorkspaceStale);
  rig.run(500);
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kLinkLost) << "now the phantom is silent altogether";
}

TEST(AudioPercept, AFailedSelfTestSoundsEvenAtTheStartAMissingWorkspaceDoesNot) {
  for (const PerceptCondition model : {PerceptCondition::kWorkspaceStale, PerceptCondition::kStateStale,
                                       PerceptCondition::kSelfTestFailed}) {
    PerceptRig rig;
    rig.model = model;
    for (int i = 0; i < 30; ++i) rig.sense(0.0, 0.0, false), rig.run(10);
    EXPECT_EQ(rig.percept.alarm(), model == PerceptCondition::kSelfTestFailed
                                       ? percept::Alarm::kWorkspaceStale
                                       : percept::Alarm::kNone);
  }
}

TEST(AudioPercept, AnAgedWorkspaceIsSaidWhileThePerceptGoesOn) {
  PerceptRig rig;
  rig.model = PerceptCondition::kWorkspaceBehind;
  rig.run_sensing(1500, 0.6, 0.1);
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kWorkspaceAged);
  EXPECT_EQ(rig.percept.situation(), Situation::kSounding);
  EXPECT_GT(rig.percept.tone().gain, 0.0);
  EXPECT_EQ(rig.percept.bursts(), 1U);
}

TEST(AudioPercept, AMutedContactIsSaidOnce) {
  PerceptRig rig;
  for (int i = 0; i < 6000; ++i) {
    rig.sense(0.0, 0.1);
    rig.inputs.percept.muted_sensors = 1;
    rig.run(10);
  }
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kMutedContact);
  EXPECT_EQ(rig.percept.bursts(), 1U);
}

TEST(AudioPercept, AResetByTheOperatorMakesWhatStandsRare) {
  PerceptRig rig;
  rig.link(rig.inputs.slave, LinkState::kStopped);
  rig.run(1000);
  rig.inputs.command.reset_ns = rig.now_ns;
  for (int i = 0; i < 280; ++i) rig.link(rig.inputs.slave, LinkState::kStopped), rig.run(100);
  EXPECT_EQ(rig.percept.bursts(), 1U);
  for (int i = 0; i < 20; ++i) rig.link(rig.inputs.slave, LinkState::kStopped), rig.run(100);
  EXPECT_EQ(rig.percept.bursts(), 2U);
}

TEST(AudioPercept, AnAlertSoundsForItsTimeAndNotBeyondItsEnd) {
  PerceptRig rig;
  rig.inputs.alerts = {rig.now_ns, 1};
  rig.run_sensing(1000, 0.9, 0.1);
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kUnsafeMotion);
  rig.run_sensing(600, 0.9, 0.1);
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kNone) << "an alert that lasts does not sound for ever";
  rig.inputs.alerts = {rig.now_ns, 2};
  rig.run_sensing(100, 0.9, 0.1);
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kUnsafeMotion);
  EXPECT_EQ(rig.percept.sounding(), percept::Alarm::kUnsafeMotion);
  rig.inputs.alerts.active = 0;
  rig.run_sensing(10, 0.9, 0.1);
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kNone);
  EXPECT_EQ(rig.percept.sounding(), percept::Alarm::kNone);
}

TEST(AudioPercept, StepUsesNoHeap) {
  PerceptRig rig;
  const test::HeapGuard guard;
  rig.inputs.alerts = {rig.now_ns, 1};
  rig.run_sensing(300, 0.6, 0.1);
  rig.run(500);
  rig.link(rig.inputs.master, LinkState::kStopped);
  rig.run(100);
}

}  // namespace
}  // namespace phantom::audio_percept
