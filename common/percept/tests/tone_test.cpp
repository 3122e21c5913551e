#include "common/percept/tone.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <vector>

#include "tests/support/heap_guard.hpp"

namespace phantom::percept {
namespace {

constexpr double kRate_Hz = 48000.0;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::vector<float> render(ToneSynthesizer& synthesizer, double duration_s) {
  std::vector<float> samples(static_cast<std::size_t>(std::lround(duration_s * kRate_Hz)));
  synthesizer.render(samples);
  return samples;
}

using Spectrum = std::complex<double>;

// Windowed discrete Fourier transform of half the samples, from `start`, at one frequency.
Spectrum bin_at(const std::vector<float>& samples, std::size_t start, double frequency_Hz) {
  const std::size_t length = samples.size() / 2;
  Spectrum sum = 0.0;
  for (std::size_t i = 0; i < length; ++i) {
    const double turn = 2.0 * std::numbers::pi;
    const double window = 0.5 - 0.5 * std::cos(turn * static_cast<double>(i) / static_cast<double>(length));
    const double angle = turn * frequency_Hz * static_cast<double>(start + i) / kRate_Hz;
    sum += window * static_cast<double>(samples[start + i]) * std::polar(1.0, -angle);
  }
  return sum;
}

// Strongest frequency within ±15 % of `near_Hz`: the highest bin, then what its phase advances by within 5
// ms.
double measured_frequency_Hz(const std::vector<float>& samples, double near_Hz) {
  double best_Hz = near_Hz, best = 0.0;
  for (double f = 0.85 * near_Hz; f < 1.15 * near_Hz; f += 2.0) {
    const double magnitude = std::abs(bin_at(samples, 0, f));
    if (magnitude > best) best = magnitude, best_Hz = f;
  }
  const std::size_t step = 240;
  const double advance = std::arg(bin_at(samples, step, best_Hz) / bin_at(samples, 0, best_Hz));
  return best_Hz + advance / (2.0 * std::numbers::pi) * kRate_Hz / static_cast<double>(step);
}

double peak(const std::vector<float>& samples) {
  double greatest = 0.0;
  for (float sample : samples) greatest = std::max(greatest, std::abs(static_cast<double>(sample)));
  return greatest;
}

double greatest_second_difference(const std::vector<float>& samples) {
  double greatest = 0.0;
  for (std::size_t i = 2; i < samples.size(); ++i) {
    greatest = std::max(greatest,
                        std::abs(static_cast<double>(samples[i]) - 2.0 * static_cast<double>(samples[i - 1]) +
                                 static_cast<double>(samples[i - 2])));
  }
  return greatest;
}

TEST(ToneLaw, ExponentialStepsOfClosenessAreEqualIntervals) {
  const ToneLaw law;
  const double interval = tone_of(law, 0.5, 0.1).frequency_Hz / tone_of(law, 0.25, 0.1).frequency_Hz;
  EXPECT_NEAR(tone_of(law, 1.0, 0.1).frequency_Hz / tone_of(law, 0.75, 0.1).frequency_Hz, interval, 1e-9);
  EXPECT_NEAR(tone_of(law, 1.0, 0.1).frequency_Hz, 1760.0, 1e-9);
  EXPECT_NEAR(tone_of(law, 1e-12, 0.1).frequency_Hz, 220.0, 1e-6);
}

TEST(ToneLaw, LinearStepsOfClosenessAreEqualFrequencySteps) {
  ToneLaw law;
  law.pitch = PitchLaw::kLinear;
  EXPECT_NEAR(tone_of(law, 0.5, 0.1).frequency_Hz, 990.0, 1e-9);
  EXPECT_NEAR(tone_of(law, 0.25, 0.1).frequency_Hz, 605.0, 1e-9);
}

TEST(ToneLaw, GainRisesWithSpeedFromANonZeroMinimum) {
  const ToneLaw law;
  double previous = 0.0;
  for (double speed : {0.0, 0.01, 0.05, 0.1, 0.2, 0.25}) {
    const double gain = tone_of(law, 0.6, speed).gain;
    EXPECT_GT(gain, previous);
    previous = gain;
  }
  EXPECT_DOUBLE_EQ(tone_of(law, 0.6, 3.0).gain, previous) << "no louder than full gain";
}

TEST(ToneLaw, SilenceOnlyInFreeSpace) {
  const ToneLaw law;
  EXPECT_EQ(tone_of(law, 0.0, 0.5).gain, 0.0);
  EXPECT_EQ(tone_of(law, -0.1, 0.5).gain, 0.0);
  for (double closeness = 0.001; closeness <= 1.0; closeness += 0.037) {
    EXPECT_GT(tone_of(law, closeness, 0.0).gain, 0.005) << "at standstill, closeness " << closeness;
  }
}

TEST(ToneLaw, NotANumberIsSilence) {
  const ToneLaw law;
  EXPECT_EQ(tone_of(law, kNan, 0.1).gain, 0.0);
  EXPECT_EQ(tone_of(law, 0.5, kNan).gain, 0.0);
}

TEST(ToneLaw, LoudnessIsLevelledAgainstTheEarAndNeverAmplified) {
  const ToneLaw law;
  // A-weighting: −10.8 dB at 200 Hz… 0 dB at 1 kHz. The table value at 250 Hz is −8.6 dB.
  const double decibel = 20.0 * std::log10(loudness_factor(law, 1000.0) / loudness_factor(law, 250.0));
  EXPECT_NEAR(decibel, -8.6, 0.1);
  EXPECT_DOUBLE_EQ(loudness_factor(law, 220.0), 1.0);
  for (double f = 220.0; f < 1760.0; f *= 1.1) EXPECT_LE(loudness_factor(law, f), 1.0);
}

TEST(ToneSynthesizer, RendersTheFrequencyOfTheLaw) {
  for (double closeness : {0.1, 0.28, 0.41, 0.63, 1.0}) {
    const Tone tone = tone_of({}, closeness, 0.2);
    ToneSynthesizer synthesizer;
    synthesizer.set_tone(tone);
    render(synthesizer, 0.2);
    const double measured = measured_frequency_Hz(render(synthesizer, 0.4), tone.frequency_Hz * 1.1);
    EXPECT_NEAR(measured, tone.frequency_Hz, 0.0005 * tone.frequency_Hz);
  }
}

TEST(ToneSynthesizer, GlidesToANewFrequency) {
  ToneSynthesizer synthesizer;
  synthesizer.set_tone({300.0, 0.5});
  render(synthesizer, 0.1);
  synthesizer.set_tone({1200.0, 0.5});
  render(synthesizer, 0.1);
  EXPECT_NEAR(measured_frequency_Hz(render(synthesizer, 0.4), 1300.0), 1200.0, 0.6);
}

TEST(ToneSynthesizer, LevelFollowsTheGainWithinFiveTimesTheSmoothing) {
  ToneSynthesizer synthesizer;
  for (double gain : {0.1, 0.6, 0.02, 0.4}) {
    synthesizer.set_tone({440.0, gain});
    render(synthesizer, 0.05);
    EXPECT_NEAR(peak(render(synthesizer, 0.05)), gain, 0.02 * gain + 1e-4);
  }
}

TEST(ToneSynthesizer, FadesToExactSilence) {
  ToneSynthesizer synthesizer;
  synthesizer.set_tone({440.0, 0.6});
  render(synthesizer, 0.1);
  synthesizer.set_tone({440.0, 0.0});
  render(synthesizer, 0.15);
  EXPECT_EQ(peak(render(synthesizer, 0.1)), 0.0);
}

TEST(ToneSynthesizer, NotANumberFadesOut) {
  ToneSynthesizer synthesizer;
  synthesizer.set_tone({440.0, 0.6});
  render(synthesizer, 0.1);
  synthesizer.set_tone({kNan, 0.6});
  render(synthesizer, 0.15);
  EXPECT_EQ(peak(render(synthesizer, 0.05)), 0.0);
  synthesizer.set_tone({440.0, kNan});
  EXPECT_EQ(peak(render(synthesizer, 0.05)), 0.0);
}

TEST(ToneSynthesizer, BeginsAtItsPitchWithoutASweep) {
  ToneSynthesizer synthesizer;
  synthesizer.set_tone({220.0, 0.5});
  render(synthesizer, 0.1);
  synthesizer.set_tone({220.0, 0.0});
  render(synthesizer, 0.2);
  synthesizer.set_tone({1760.0, 0.5});
  const std::vector<float> begin = render(synthesizer, 0.02);
  int upward_crossings = 0;
  for (std::size_t i = 1; i < begin.size(); ++i) upward_crossings += begin[i - 1] < 0.0F && begin[i] >= 0.0F;
  EXPECT_NEAR(upward_crossings, 1760.0 * 0.02, 1.5);
}

TEST(ToneSynthesizer, JumpsOfTheTargetsDoNotClick) {
  // A steady sine of amplitude a and frequency f has second differences up to a·(2πf/rate)². A jump of the
  // signal by only 0.05 would add 0.05 to that.
  const double steady = 0.6 * std::pow(2.0 * std::numbers::pi * 1760.0 / kRate_Hz, 2);
  ToneSynthesizer synthesizer;
  unsigned state = 1;
  for (int i = 0; i < 400; ++i) {
    state = state * 1664525U + 1013904223U;
    const double a = static_cast<double>(state >> 16) / 65536.0;
    synthesizer.set_tone({220.0 * std::pow(8.0, a), i % 3 == 0 ? 0.0 : 0.6});
    EXPECT_LT(greatest_second_difference(render(synthesizer, 0.005)), steady + 0.005);
  }
}

TEST(ToneSynthesizer, NoClickAcrossPeriods) {
  ToneSynthesizer synthesizer;
  std::vector<float> all;
  for (int i = 0; i < 100; ++i) {
    synthesizer.set_tone({i % 2 == 0 ? 220.0 : 1760.0, i % 5 == 0 ? 0.0 : 0.6});
    const auto period = render(synthesizer, 0.005);
    all.insert(all.end(), period.begin(), period.end());
  }
  EXPECT_LT(greatest_second_difference(all),
            0.6 * std::pow(2.0 * std::numbers::pi * 1760.0 / kRate_Hz, 2) + 0.005);
}

// Loud stretches (start, length in seconds) of a rendered alarm.
std::vector<std::pair<double, double>> pulses_of(Alarm alarm, double duration_s) {
  ToneSynthesizer synthesizer;
  synthesizer.set_alarm(alarm);
  std::vector<std::pair<double, double>> pulses;
  const double window_s = 0.005;
  bool loud = false;
  for (double t = 0.0; t < duration_s; t += window_s) {
    const bool now = peak(render(synthesizer, window_s)) > 0.1;
    if (now && !loud) pulses.emplace_back(t, 0.0);
    if (now) pulses.back().second += window_s;
    loud = now;
  }
  return pulses;
}

TEST(Alarms, AreToldApartByTheirPattern) {
  EXPECT_TRUE(pulses_of(Alarm::kNone, 2.0).empty());
  EXPECT_EQ(pulses_of(Alarm::kLinkLost, 2.0).size(), 2U);       // two beeps in two seconds
  EXPECT_EQ(pulses_of(Alarm::kUnsafeMotion, 2.0).size(), 16U);  // eight pulses a second
  EXPECT_EQ(pulses_of(Alarm::kStopped, 2.0).size(), 1U);  // never pauses
}

TEST(Alarms, NeverPassFullScaleNorClickOverAPercept) {
  for (Alarm alarm : {Alarm::kLinkLost, Alarm::kUnsafeMotion, Alarm::kStopped}) {
    ToneSynthesizer synthesizer;
    synthesizer.set_tone({1000.0, 0.6});
    synthesizer.set_alarm(alarm);
    const auto samples = render(synthesizer, 2.5);
    EXPECT_LT(peak(samples), 1.0);
    // The alarm's third harmonic is the steepest part: 0.3·(1/3)·(2π·3·2489/48000)².
    EXPECT_LT(greatest_second_difference(samples), 0.17);
  }
}

TEST(Alarms, PatternsAreFiniteAndRepeat) {
  for (Alarm alarm : {Alarm::kLinkLost, Alarm::kUnsafeMotion, Alarm::kStopped}) {
    for (const AlarmStep& step : alarm_pattern(alarm)) EXPECT_GT(step.duration_s, 0.05);
  }
  EXPECT_TRUE(alarm_pattern(Alarm::kNone).empty());
}

TEST(Alarms, EndWithoutATrace) {
  ToneSynthesizer synthesizer;
  synthesizer.set_alarm(Alarm::kStopped);
  render(synthesizer, 0.5);
  synthesizer.set_alarm(Alarm::kNone);
  render(synthesizer, 0.15);
  EXPECT_EQ(peak(render(synthesizer, 0.1)), 0.0);
}

TEST(ToneSynthesizer, UsesNoHeap) {
  ToneSynthesizer synthesizer;
  std::array<float, 240> period{};
  const test::HeapGuard guard;
  for (int i = 0; i < 1000; ++i) {
    synthesizer.set_tone(tone_of({}, i % 100 * 0.01, i % 7 * 0.05));
    synthesizer.set_alarm(static_cast<Alarm>(i / 250));
    synthesizer.render(period);
  }
}

}  // namespace
}  // namespace phantom::percept
