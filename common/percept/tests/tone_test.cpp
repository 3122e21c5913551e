#include "common/percept/tone.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <vector>

#include "common/percept/equal_loudness.hpp"
#include "common/percept/tests/sound.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::percept {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

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

TEST(ToneLaw, ExponentialStepsOfClosenessAreEqualIntervals) {
  const ToneLaw law;
  const double interval = tone_of(law, 0.5, 0.1).frequency_Hz / tone_of(law, 0.25, 0.1).frequency_Hz;
  EXPECT_NEAR(tone_of(law, 1.0, 0.1).frequency_Hz / tone_of(law, 0.75, 0.1).frequency_Hz, interval, 1e-9);
  EXPECT_NEAR(tone_of(law, 1.0, 0.1).frequency_Hz, 1760.0, 1e-9);
  EXPECT_NEAR(tone_of(law, 1e-12, 0.1).frequency_Hz, 220.0, 1e-6);
}

TEST(ToneLaw, LinearStepsOfClosenessAreEqualFrequencySteps) {
  ToneLaw law;
  law.pitch = MappingLaw::kLinear;
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

TEST(ToneLaw, PowerStepsLieAsTheirExponentHasThem) {
  ToneLaw law;
  law.pitch = MappingLaw::kPower;
  law.pitch_exponent = 2.0;
  EXPECT_NEAR(tone_of(law, 0.5, 0.1).frequency_Hz, 220.0 + 1540.0 * 0.25, 1e-9);
  law.pitch_exponent = 0.5;
  EXPECT_NEAR(tone_of(law, 0.25, 0.1).frequency_Hz, 220.0 + 1540.0 * 0.5, 1e-9);
}

TEST(ToneLaw, EveryLawRunsFromEndToEndAndRises) {
  for (const MappingLaw pitch : {MappingLaw::kExponential, MappingLaw::kPower, MappingLaw::kLinear}) {
    for (const MappingLaw level : {MappingLaw::kPower, MappingLaw::kExponential, MappingLaw::kLinear}) {
      ToneLaw law;
      law.pitch = pitch;
      law.level = level;
      law.loudness_phon = 0.0;
      EXPECT_NEAR(tone_of(law, 1.0, 0.25).frequency_Hz, 1760.0, 1e-9);
      EXPECT_NEAR(tone_of(law, 1.0, 0.25).gain, 0.6, 1e-12);
      EXPECT_NEAR(tone_of(law, 1e-9, 0.0).frequency_Hz, 220.0, 1e-3);
      EXPECT_NEAR(tone_of(law, 1e-9, 0.0).gain, 0.08, 1e-12);
      Tone before{0.0, 0.0};
      for (int i = 1; i <= 20; ++i) {
        const Tone tone = tone_of(law, i / 20.0, i / 80.0);
        EXPECT_GT(tone.frequency_Hz, before.frequency_Hz);
        EXPECT_GT(tone.gain, before.gain);
        before = tone;
      }
    }
  }
}

TEST(ToneLaw, ExponentialStepsOfSpeedAreEqualStepsInDecibels) {
  ToneLaw law;
  law.level = MappingLaw::kExponential;
  const auto gain = [&](double speed_m_s) { return tone_of(law, 0.5, speed_m_s).gain; };
  EXPECT_NEAR(gain(0.10) / gain(0.05), gain(0.25) / gain(0.20), 1e-9);
  law.level = MappingLaw::kLinear;
  EXPECT_NEAR(gain(0.10) - gain(0.05), gain(0.25) - gain(0.20), 1e-9);
}

TEST(ToneLaw, AllPitchesAreEquallyLoudAndNoneIsAmplified) {
  for (const double phon : {30.0, 60.0, 80.0}) {
    ToneLaw law;
    law.loudness_phon = phon;
    double greatest = 0.0;
    const double reference_dB = 20.0 * std::log10(loudness_factor(law, 1000.0)) - phon;
    for (double f = 220.0; f <= 1760.0; f *= 1.01) {
      const double factor = loudness_factor(law, f);
      greatest = std::max(greatest, factor);
      EXPECT_NEAR(20.0 * std::log10(factor) - equal_loudness_level_dB(f, phon), reference_dB, 0.05) << f;
    }
    EXPECT_LE(greatest, 1.0);
    EXPECT_GT(greatest, 0.99) << "what is heard least keeps its amplitude";
  }
  ToneLaw none;
  none.loudness_phon = 0.0;
  EXPECT_EQ(loudness_factor(none, 300.0), 1.0);
}

TEST(ToneLaw, TheRateOfPulsesIsUrgencyAloneAndItsStepsAreTold) {
  const ToneLaw law;
  EXPECT_EQ(pulse_rate_Hz(law, -1.0), 0.0) << "nothing nears";
  EXPECT_EQ(pulse_rate_Hz(law, 3.0), 0.0);
  EXPECT_EQ(pulse_rate_Hz(law, kNan), 0.0);
  EXPECT_EQ(pulse_rate_Hz(law, std::numeric_limits<double>::infinity()), 0.0);
  EXPECT_NEAR(pulse_rate_Hz(law, 3.0 - 1e-9), law.min_pulse_Hz, 1e-6);
  EXPECT_EQ(pulse_rate_Hz(law, 0.5), law.max_pulse_Hz);
  EXPECT_EQ(pulse_rate_Hz(law, 0.0), law.max_pulse_Hz);
  const double step = pulse_rate_Hz(law, 1.5) / pulse_rate_Hz(law, 2.0);
  EXPECT_NEAR(pulse_rate_Hz(law, 1.0) / pulse_rate_Hz(law, 1.5), step, 1e-9) << "equal ratios";
  EXPECT_GT(step, 1.25) << "half a second is heard: the ear tells rates that differ by a tenth";
  const Tone steady = tone_of(law, 0.6, 0.1), pulsing = tone_of(law, 0.6, 0.1, 0.7);
  EXPECT_EQ(pulsing.frequency_Hz, steady.frequency_Hz);
  EXPECT_EQ(pulsing.gain, steady.gain);
  EXPECT_EQ(steady.pulse_Hz, 0.0);
  EXPECT_GT(pulsing.pulse_floor, 0.0) << "never silent near an object";
  ToneLaw none;
  none.pulses_from_s = 0.0;
  EXPECT_EQ(tone_of(none, 0.6, 0.1, 0.1).pulse_Hz, 0.0);
}

/// Returns the peaks of stretches of 5 ms.
std::vector<double> envelope_of(const std::vector<float>& samples) {
  const std::size_t length = 240;
  std::vector<double> peaks;
  for (std::size_t i = 0; i + length <= samples.size(); i += length)
    peaks.push_back(peak({samples.begin() + static_cast<std::ptrdiff_t>(i),
                          samples.begin() + static_cast<std::ptrdiff_t>(i + length)}));
  return peaks;
}

TEST(ToneSynthesizer, PulsesAtTheirRateBetweenTheLevelAndItsFloor) {
  for (const double rate_Hz : {1.6, 4.0, 9.0}) {
    ToneSynthesizer synthesizer;
    synthesizer.set_tone({880.0, 0.5, rate_Hz, 0.3});
    render(synthesizer, 0.5);
    const std::vector<float> sound = render(synthesizer, 5.0);
    const std::vector<double> envelope = envelope_of(sound);
    EXPECT_NEAR(*std::max_element(envelope.begin(), envelope.end()), 0.5, 0.01) << rate_Hz;
    EXPECT_NEAR(*std::min_element(envelope.begin(), envelope.end()), 0.15, 0.02) << rate_Hz;
    int rises = 0;
    for (std::size_t i = 1; i < envelope.size(); ++i)
      rises += envelope[i - 1] < 0.325 && envelope[i] >= 0.325;
    EXPECT_NEAR(rises, 5.0 * rate_Hz, 1.0);
    const std::vector<float> second(sound.begin(), sound.begin() + 48000);
    EXPECT_NEAR(measured_frequency_Hz(second, 900.0), 880.0, 1.0) << "the pitch stays";
    EXPECT_LT(greatest_second_difference(sound),
              1.02 * 0.5 * std::pow(2.0 * std::numbers::pi * 880.0 / kRate_Hz, 2))
        << "pulses do not click";
  }
}

TEST(ToneSynthesizer, IsSteadyAgainOnceNothingIsAhead) {
  ToneSynthesizer synthesizer;
  synthesizer.set_tone({440.0, 0.5, 9.0, 0.3});
  render(synthesizer, 0.48);
  synthesizer.set_tone({440.0, 0.5});
  render(synthesizer, 0.1);
  for (const double level : envelope_of(render(synthesizer, 0.5))) EXPECT_NEAR(level, 0.5, 0.01);
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

TEST(ToneSynthesizer, UsesNoHeap) {
  ToneSynthesizer synthesizer;
  std::array<float, 240> period{}, alarm{};
  const test::HeapGuard guard;
  for (int i = 0; i < 1000; ++i) {
    synthesizer.set_tone(tone_of({}, i % 100 * 0.01, i % 7 * 0.05));
    if (i % 100 == 0) synthesizer.start_alarm(static_cast<Alarm>(i / 130));
    synthesizer.render(period, alarm);
  }
}

}  // namespace
}  // namespace phantom::percept
