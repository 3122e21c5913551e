// The rendered sound itself, from samples of the topics to frames: frequency and level as the laws have them,
// no clicks.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <vector>

#include "components/audio_percept/audio_percept.hpp"
#include "components/audio_percept/spatialiser.hpp"
#include "components/audio_percept/tests/test_config.hpp"

namespace phantom::audio_percept {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;

/// The component's signal path on a clock that moves with what it renders.
struct SoundRig {
  AudioPerceptConfig config;
  AudioPercept percept;
  Spatialiser spatialiser;
  Inputs inputs;
  core::Nanoseconds now_ns = 1'000'000 * core::kNsPerMillisecond;
  std::vector<double> contacts_s;  // of the threats, the most urgent first
  std::vector<float> frames;       // all that was rendered

  explicit SoundRig(AudioPerceptConfig with = test_config())
      : config(with), percept(with), spatialiser(with.layout, with.listener.near_m) {}
  /// `periods` of 5 ms with a percept every 10 ms.
  void sense(double closeness, double speed_m_s, int periods, Vector3 position_m = {0, 0, 0}) {
    for (int i = 0; i < periods; ++i) {
      if (i % 2 == 0) {
        inputs.percept = {
            {.valid = true, .closeness = closeness, .speed_m_s = speed_m_s, .position_m = position_m},
            now_ns};
        for (const double contact_s : contacts_s) {
          messages::Threat threat;
          threat.contact.time_s = contact_s;
          inputs.percept.threats.push_back(threat);
        }
      }
      period();
    }
  }
  void period() {
    std::array<float, kPeriodFrames> tone{}, alarm{};
    now_ns += 5 * core::kNsPerMillisecond;
    inputs.now_ns = now_ns;
    percept.step(inputs, tone, alarm);
    const std::size_t at = frames.size();
    frames.resize(at + kPeriodFrames * channel_count(config.layout));
    spatialiser.render(tone, alarm, percept.source_position(), std::span(frames).subspan(at));
  }
  std::vector<float> last(double seconds, std::size_t channel = 0) const {
    const std::size_t channels = channel_count(config.layout);
    std::vector<float> one;
    for (std::size_t i =
             frames.size() - static_cast<std::size_t>(seconds * kSampleRate_Hz) * channels + channel;
         i < frames.size(); i += channels)
      one.push_back(frames[i]);
    return one;
  }
};

/// Amplitude of a sine of that frequency in the samples (Hann window, Goertzel's sum).
double amplitude_at(const std::vector<float>& samples, double frequency_Hz) {
  std::complex<double> sum = 0.0;
  double weight = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double t = static_cast<double>(i);
    const double window = 0.5 - 0.5 * std::cos(kTurn * t / static_cast<double>(samples.size()));
    sum += window * static_cast<double>(samples[i]) *
           std::polar(1.0, -kTurn * frequency_Hz * t / kSampleRate_Hz);
    weight += window;
  }
  return 2.0 * std::abs(sum) / weight;
}

/// Frequency of the greatest amplitude between two, to a fiftieth of a semitone.
double strongest_Hz(const std::vector<float>& samples, double low_Hz, double high_Hz) {
  double best_Hz = low_Hz, best = 0.0;
  for (double f = low_Hz; f <= high_Hz; f *= std::exp2(1.0 / 24.0)) {
    const double a = amplitude_at(samples, f);
    if (a > best) best = a, best_Hz = f;
  }
  const double from = best_Hz * std::exp2(-1.0 / 24.0), to = best_Hz * std::exp2(1.0 / 24.0);
  for (double f = from; f <= to; f *= std::exp2(1.0 / 600.0)) {
    const double a = amplitude_at(samples, f);
    if (a > best) best = a, best_Hz = f;
  }
  return best_Hz;
}

double greatest_second_difference(const std::vector<float>& frames, std::size_t channels) {
  double greatest = 0.0;
  for (std::size_t i = 2 * channels; i < frames.size(); ++i) {
    greatest = std::max(
        greatest, std::abs(static_cast<double>(frames[i]) - 2.0 * static_cast<double>(frames[i - channels]) +
                           static_cast<double>(frames[i - 2 * channels])));
  }
  return greatest;
}

TEST(Sound, FrequencyAndLevelFollowEveryLaw) {
  for (const percept::MappingLaw pitch :
       {percept::MappingLaw::kExponential, percept::MappingLaw::kPower, percept::MappingLaw::kLinear}) {
    for (const percept::MappingLaw level :
         {percept::MappingLaw::kPower, percept::MappingLaw::kExponential, percept::MappingLaw::kLinear}) {
      AudioPerceptConfig config = test_config();
      config.law.pitch = pitch;
      config.law.level = level;
      SoundRig rig(config);
      for (const auto& [closeness, speed_m_s] : {std::pair{0.15, 0.02}, {0.5, 0.0}, {0.85, 0.2}}) {
        rig.sense(closeness, speed_m_s, 60);
        const percept::Tone expected = percept::tone_of(config.law, closeness, speed_m_s);
        const auto sound = rig.last(0.2);
        EXPECT_NEAR(12.0 * std::log2(strongest_Hz(sound, 180.0, 2200.0) / expected.frequency_Hz), 0.0, 0.05)
            << "semitones";
        EXPECT_NEAR(20.0 * std::log10(amplitude_at(sound, expected.frequency_Hz) / expected.gain), 0.0, 0.1)
            << "decibels";
      }
    }
  }
}

// Tries times to contact of the most urgent threat, with a less urgent one beside it, and none.
TEST(Sound, TheRateOfPulsesIsTheUrgencyAndChangesNeitherPitchNorLevel) {
  const auto pulses_in = [](const std::vector<float>& sound, double gain) {
    int rises = 0;
    bool low = false;
    const std::size_t length = 240;
    for (std::size_t i = 0; i + length <= sound.size(); i += length) {
      float level = 0.0F;
      for (std::size_t k = i; k < i + length; ++k) level = std::max(level, std::abs(sound[k]));
      if (low && level > 0.9 * gain) ++rises, low = false;
      if (level < 0.5 * gain) low = true;
    }
    return rises;
  };
  for (const std::vector<double>& contacts_s : {std::vector{2.5, 2.9}, {1.5, 2.9}, {0.5, 2.9}, {-1.0}, {}}) {
    SoundRig rig;
    rig.contacts_s = contacts_s;
    rig.sense(0.6, 0.1, 1000);
    const percept::Tone law = percept::tone_of(rig.config.law, 0.6, 0.1);
    const double soonest_s = contacts_s.empty() ? -1.0 : contacts_s.front();
    const auto sound = rig.last(4.0);
    EXPECT_NEAR(pulses_in(sound, law.gain), 4.0 * percept::pulse_rate_Hz(rig.config.law, soonest_s), 1.0)
        << soonest_s;
    EXPECT_NEAR(12.0 * std::log2(strongest_Hz(rig.last(0.2), 180.0, 2200.0) / law.frequency_Hz), 0.0, 0.05);
    float level = 0.0F;
    for (const float sample : sound) level = std::max(level, std::abs(sample));
    EXPECT_NEAR(level, law.gain, 0.02 * law.gain);
  }
}

TEST(Sound, ThePerceptIsAPureTone) {
  SoundRig rig;
  rig.sense(0.5, 0.1, 60);
  const double f = percept::tone_of(rig.config.law, 0.5, 0.1).frequency_Hz;
  const auto sound = rig.last(0.2);
  for (int harmonic = 2; harmonic <= 6; ++harmonic)
    EXPECT_LT(20.0 * std::log10(amplitude_at(sound, harmonic * f) / amplitude_at(sound, f)), -60.0);
}

TEST(Sound, AnAlarmIsToldFromThePerceptByItsOddHarmonics) {
  SoundRig rig;
  rig.inputs.slave.received_ns = rig.now_ns;
  rig.inputs.slave.state = teleop::LinkState::kStopped;
  for (int i = 0; i < 28; ++i) rig.period();  // into the end of the first pulse
  const auto sound = rig.last(0.1);
  const double f = 932.0, ground = amplitude_at(sound, f);
  EXPECT_GT(ground, 0.25);
  EXPECT_NEAR(amplitude_at(sound, 3 * f) / ground, 1.0 / 3, 0.02);
  EXPECT_NEAR(amplitude_at(sound, 5 * f) / ground, 1.0 / 5, 0.02);
  EXPECT_LT(amplitude_at(sound, 2 * f) / ground, 0.01);
}

TEST(Sound, NothingThatComesMakesItClick) {
  // A steady sine of amplitude a and frequency f has second differences up to a·(2πf/rate)², the alarm's four
  // odd harmonics sixteen times that; panning adds no more than it has gain (below 1.2). A click of 2 % of
  // full scale would stand out.
  const double steepest = 0.6 * std::pow(kTurn * 1760.0 / kSampleRate_Hz, 2) +
                          0.3 * 16.0 * std::pow(kTurn * 1245.0 / kSampleRate_Hz, 2);
  for (const Layout layout : {Layout::kMono, Layout::kStereo, Layout::k5_1}) {
    SoundRig rig(test_config(layout));
    std::mt19937 random(11);
    std::uniform_real_distribution<double> share(0.0, 1.0);
    for (int i = 0; i < 600; ++i) {
      const double closeness = random() % 4 == 0 ? 0.0 : share(random);
      rig.inputs.alerts = {random() % 20 == 0 ? rig.now_ns : rig.inputs.alerts.raised_ns,
                           static_cast<std::uint32_t>(random() % 2)};
      rig.inputs.slave.received_ns = rig.inputs.master.received_ns = rig.now_ns;
      rig.inputs.slave.state = random() % 30 == 0 ? teleop::LinkState::kStopped : teleop::LinkState::kCoupled;
      rig.inputs.master.state = teleop::LinkState::kCoupled;
      rig.inputs.master.tone_enabled = random() % 3 != 0;
      rig.sense(closeness, 0.3 * share(random), 2,
                {4 * share(random) - 2, 4 * share(random) - 2, 2 * share(random)});
    }
    EXPECT_LT(greatest_second_difference(rig.frames, channel_count(layout)), 1.2 * steepest + 0.02)
        << name_of(layout);
  }
}

// Tries audio_percept: no viewer
TEST(Sound, ThePerceptMovesWithItsPlaceAndWithTheView) {
  AudioPerceptConfig config = test_config(Layout::kStereo);
  config.listener.view = percept::ViewNode::kSouth;  // x is right
  config.listener.position_m = {0, 0, 0};
  SoundRig rig(config);
  const auto rightness_dB = [&] {
    const double f = percept::tone_of(config.law, 0.5, 0.1).frequency_Hz;
    return 20.0 * std::log10(amplitude_at(rig.last(0.1, 1), f) / amplitude_at(rig.last(0.1, 0), f));
  };
  rig.sense(0.5, 0.1, 100, {1, 0.3, 0});
  EXPECT_GT(rightness_dB(), 6.0);
  rig.sense(0.5, 0.1, 100, {-1, 0.3, 0});
  EXPECT_LT(rightness_dB(), -6.0);
  rig.inputs.command.view = percept::ViewNode::kNorth;  // what was left is right
  rig.sense(0.5, 0.1, 100, {-1, 0.3, 0});
  EXPECT_GT(rightness_dB(), 6.0);
}

// What is seen and what is heard face alike, whoever chose the view; a viewer that fell silent does not
// count.
// Tries audio_percept: it falls silent
TEST(Sound, ThePerceptMovesWithTheViewThatTheViewerTells) {
  AudioPerceptConfig config = test_config(Layout::kStereo);
  config.listener.view = percept::ViewNode::kSouth;  // x is right
  config.listener.position_m = {0, 0, 0};
  config.listener.view_timeout_ns = core::from_seconds(0.5);
  SoundRig rig(config);
  const auto is_right = [&] {
    const double f = percept::tone_of(config.law, 0.5, 0.1).frequency_Hz;
    return amplitude_at(rig.last(0.1, 1), f) > 2 * amplitude_at(rig.last(0.1, 0), f);
  };
  const auto turn_north = [&] {
    rig.inputs.view = {rig.now_ns, listener_axes(config.listener, percept::ViewNode::kNorth)};
  };
  turn_north();
  rig.sense(0.5, 0.1, 60, {-1, 0.3, 0});
  EXPECT_TRUE(is_right());
  rig.inputs.command.view = percept::ViewNode::kSouth;
  turn_north();
  rig.sense(0.5, 0.1, 60, {-1, 0.3, 0});
  EXPECT_TRUE(is_right()) << "the viewer has heard the operator's choice, too";
  rig.sense(0.5, 0.1, 160, {-1, 0.3, 0});
  EXPECT_FALSE(is_right()) << "the viewer is silent for longer than half a second";
  rig.inputs.command.view = percept::ViewNode::kNorth;
  rig.sense(0.5, 0.1, 60, {-1, 0.3, 0});
  EXPECT_TRUE(is_right()) << "then the operator's choice counts";
  SoundRig deaf([&] {
    AudioPerceptConfig other = config;
    other.listener.follow_viewer = false;
    return other;
  }());
  deaf.inputs.view = {deaf.now_ns, listener_axes(config.listener, percept::ViewNode::kNorth)};
  deaf.sense(0.5, 0.1, 60, {-1, 0.3, 0});
  EXPECT_LT(deaf.percept.source_position()[0], 0.0);
}

// Tries audio_percept: not valid any more
TEST(Sound, EndsWithinATenthOfASecondAfterThePerceptIsStale) {
  SoundRig rig;
  rig.sense(0.6, 0.2, 60);
  rig.inputs.percept.valid =
      false;  // the master's states never came: no link is lost in this scene but the percept
  for (int i = 0; i < 20; ++i) rig.period();
  const double f = percept::tone_of(rig.config.law, 0.6, 0.2).frequency_Hz;
  rig.frames.clear();
  for (int i = 0; i < 20; ++i) rig.period();
  EXPECT_LT(amplitude_at(rig.last(0.1), f), 0.01) << "only the alarm is left";
  EXPECT_EQ(rig.percept.alarm(), percept::Alarm::kLinkLost);
}

}  // namespace
}  // namespace phantom::audio_percept
