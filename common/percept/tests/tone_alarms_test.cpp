#include "common/percept/tone_alarms.hpp"

#include <gtest/gtest.h>

#include <initializer_list>
#include <numbers>
#include <set>
#include <utility>
#include <vector>

#include "common/percept/tests/sound.hpp"

namespace phantom::percept {
namespace {

constexpr std::initializer_list<Alarm> kAlarms{
    Alarm::kMutedContact, Alarm::kWorkspaceAged, Alarm::kWorkspaceStale, Alarm::kLinkLost,
    Alarm::kUnsafeMotion, Alarm::kDriveFault,    Alarm::kEmergencyStop};

// Loud stretches (start, length in seconds) of a rendered burst.
std::vector<std::pair<double, double>> pulses_of(Alarm alarm) {
  ToneSynthesizer synthesizer;
  synthesizer.start_alarm(alarm);
  std::vector<std::pair<double, double>> pulses;
  const double window_s = 0.005;
  bool loud = false;
  for (double t = 0.0; t < burst_duration_s(alarm) + 1.0; t += window_s) {
    const bool now = peak(render(synthesizer, window_s)) > 0.15 * burst_gain(alarm);
    if (now && !loud) pulses.emplace_back(t, 0.0);
    if (now) pulses.back().second += window_s;
    loud = now;
  }
  return pulses;
}

TEST(Alarms, BurstsHavePulseCountAndTimesOfTheirPriority) {
  // IEC 60601-1-8: pulses of high priority last 75 to 200 ms and come in 3 + 2, twice; of medium priority 125
  // to 250 ms, three; low priority one or two.
  for (const Alarm alarm : kAlarms) {
    const auto pulses = pulses_of(alarm);
    if (alarm == Alarm::kUnsafeMotion) {
      EXPECT_EQ(pulses.size(), 4U);
      continue;
    }
    const AlarmPriority priority = priority_of(alarm);
    const std::size_t count = priority == AlarmPriority::kHigh     ? 10
                              : priority == AlarmPriority::kMedium ? 3
                              : priority == AlarmPriority::kLow    ? 2
                                                                   : 1;
    ASSERT_EQ(pulses.size(), count) << name_of(alarm);
    for (const auto& [start_s, length_s] : pulses) {
      EXPECT_GT(length_s, priority == AlarmPriority::kMedium ? 0.125 : 0.075) << name_of(alarm);
      EXPECT_LT(length_s, priority == AlarmPriority::kHigh ? 0.200 : 0.250) << name_of(alarm);
    }
    if (count != 10) continue;
    for (std::size_t i : {0U, 5U}) {
      const double within_s = pulses[i + 1].first - pulses[i].first;
      EXPECT_GT(pulses[i + 3].first - pulses[i + 2].first, 1.5 * within_s)
          << "after the third a longer pause";
      EXPECT_NEAR(pulses[i + 4].first - pulses[i + 3].first, within_s, 0.011);
    }
  }
}

TEST(Alarms, AreToldApartByTheirPattern) {
  std::set<std::vector<std::pair<double, double>>> melodies;
  for (const Alarm alarm : kAlarms) {
    std::vector<std::pair<double, double>> melody;
    for (const AlarmPulse& pulse : alarm_burst(alarm)) melody.emplace_back(pulse.frequency_Hz, pulse.on_s);
    EXPECT_TRUE(melodies.insert(melody).second) << name_of(alarm);
  }
  EXPECT_TRUE(alarm_burst(Alarm::kNone).empty());
}

TEST(Alarms, GraverOnesAreNotQuieter) {
  Alarm before = Alarm::kMutedContact;
  for (const Alarm alarm : kAlarms) {
    EXPECT_GE(burst_gain(alarm), burst_gain(before)) << name_of(alarm);
    EXPECT_GE(priority_of(alarm), priority_of(before)) << name_of(alarm);
    before = alarm;
  }
}

TEST(Alarms, NeverPassFullScaleNorClickOverAPercept) {
  for (const Alarm alarm : kAlarms) {
    ToneSynthesizer synthesizer;
    synthesizer.set_tone({1000.0, 0.6});
    render(synthesizer, 0.1);
    synthesizer.start_alarm(alarm);
    const auto samples = render(synthesizer, burst_duration_s(alarm) + 0.3);
    EXPECT_LT(peak(samples), 1.0) << name_of(alarm);
    // Four odd harmonics k of amplitude 1/k have second differences up to (1 + 3 + 5 + 7)·a·(2πf/rate)².
    double steady = 0.6 * std::pow(2.0 * std::numbers::pi * 1000.0 / kRate_Hz, 2);
    double steepest = 0.0;
    for (const AlarmPulse& pulse : alarm_burst(alarm))
      steepest = std::max(steepest, std::pow(2.0 * std::numbers::pi * pulse.frequency_Hz / kRate_Hz, 2));
    EXPECT_LT(greatest_second_difference(samples), steady + 0.3 * 16.0 * steepest + 0.005) << name_of(alarm);
  }
}

TEST(Alarms, ABurstIsPlayedOnceAndEndsWithoutATrace) {
  for (const Alarm alarm : kAlarms) {
    ToneSynthesizer synthesizer;
    synthesizer.start_alarm(alarm);
    EXPECT_EQ(synthesizer.alarm(), alarm);
    render(synthesizer, burst_duration_s(alarm) + 0.75);
    EXPECT_EQ(synthesizer.alarm(), Alarm::kNone);
    EXPECT_EQ(peak(render(synthesizer, 0.2)), 0.0);
  }
}

TEST(Alarms, ABurstIsCutWithoutAClick) {
  ToneSynthesizer synthesizer;
  synthesizer.start_alarm(Alarm::kEmergencyStop);
  auto samples = render(synthesizer, 0.08);
  synthesizer.start_alarm(Alarm::kUnsafeMotion);
  for (const float sample : render(synthesizer, 0.05)) samples.push_back(sample);
  synthesizer.start_alarm(Alarm::kNone);
  for (const float sample : render(synthesizer, 0.3)) samples.push_back(sample);
  EXPECT_LT(greatest_second_difference(samples),
            0.3 * 16.0 * std::pow(2.0 * std::numbers::pi * 1245.0 / kRate_Hz, 2) + 0.005);
  EXPECT_EQ(samples.back(), 0.0F);
}

}  // namespace
}  // namespace phantom::percept
