#include "common/percept/tone.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace phantom::percept {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kInaudible = 1e-5;  // −100 dB of full scale

// Amplitude response of the A-weighting filter, up to a constant factor (IEC 61672-1, annex E).
double a_weighting(double frequency_Hz) noexcept {
  const double f2 = frequency_Hz * frequency_Hz;
  const auto pole = [f2](double corner_Hz) { return f2 + corner_Hz * corner_Hz; };
  return 12194.0 * 12194.0 * f2 * f2 / (pole(20.6) * std::sqrt(pole(107.7) * pole(737.9)) * pole(12194.0));
}

// Step lengths are long against the 10 ms smoothing, and pitches lie off the percept's octaves.
constexpr std::array<AlarmStep, 2> kUnsafeMotionPattern{{{2489.0, 0.065}, {0.0, 0.060}}};
constexpr std::array<AlarmStep, 4> kLinkLostPattern{
    {{622.0, 0.160}, {0.0, 0.080}, {415.0, 0.240}, {0.0, 1.520}}};
constexpr std::array<AlarmStep, 2> kStoppedPattern{{{932.0, 0.300}, {699.0, 0.300}}};

}  // namespace

double loudness_factor(const ToneLaw& law, double frequency_Hz) noexcept {
  if (!law.equal_loudness) return 1.0;
  // The curve rises to 2.5 kHz and falls beyond, so that its least value in a range lies at one of the ends.
  const double least = std::min(a_weighting(law.min_frequency_Hz), a_weighting(law.max_frequency_Hz));
  return std::min(1.0, least / a_weighting(frequency_Hz));
}

Tone tone_of(const ToneLaw& law, double closeness, double speed_m_s) noexcept {
  if (!std::isfinite(closeness) || !std::isfinite(speed_m_s) || closeness <= 0.0)
    return {law.min_frequency_Hz, 0.0};
  const double near = std::min(closeness, 1.0);
  const double span_Hz = law.max_frequency_Hz - law.min_frequency_Hz;
  const double frequency_Hz =
      law.pitch == PitchLaw::kLinear
          ? law.min_frequency_Hz + near * span_Hz
          : law.min_frequency_Hz * std::pow(law.max_frequency_Hz / law.min_frequency_Hz, near);
  const double speed = std::clamp(speed_m_s / law.full_speed_m_s, 0.0, 1.0);
  const double level = law.rest_gain + (law.full_gain - law.rest_gain) * std::pow(speed, law.speed_exponent);
  return {frequency_Hz, level * loudness_factor(law, frequency_Hz)};
}

std::span<const AlarmStep> alarm_pattern(Alarm alarm) noexcept {
  switch (alarm) {
    case Alarm::kUnsafeMotion:
      return kUnsafeMotionPattern;
    case Alarm::kLinkLost:
      return kLinkLostPattern;
    case Alarm::kStopped:
      return kStoppedPattern;
    case Alarm::kNone:
      break;
  }
  return {};
}

ToneSynthesizer::ToneSynthesizer(double sample_rate_Hz, double smoothing_s, double alarm_gain)
    : sample_rate_Hz_(sample_rate_Hz),
      share_(1.0 - std::exp(-2.0 / (smoothing_s * sample_rate_Hz))),  // half of the smoothing in each filter
      alarm_level_(alarm_gain) {}

void ToneSynthesizer::set_tone(const Tone& tone) noexcept {
  const bool audible = std::isfinite(tone.gain) && tone.gain > 0.0 && std::isfinite(tone.frequency_Hz) &&
                       tone.frequency_Hz > 0.0;
  gain_.target = audible ? std::min(tone.gain, 1.0) : 0.0;
  if (!audible) return;
  const double log_frequency = std::log(std::min(tone.frequency_Hz, 0.45 * sample_rate_Hz_));
  if (gain_.value < kInaudible) {
    log_frequency_.snap(log_frequency);
  } else {
    log_frequency_.target = log_frequency;
  }
}

void ToneSynthesizer::set_alarm(Alarm alarm) noexcept {
  if (alarm == alarm_) return;
  alarm_ = alarm;
  alarm_step_ = 0;
  alarm_step_left_s_ = 0.0;
  alarm_gain_.target = 0.0;
  if (alarm != Alarm::kNone) begin_alarm_step();
}

void ToneSynthesizer::begin_alarm_step() noexcept {
  const AlarmStep& step = alarm_pattern(alarm_)[alarm_step_];
  alarm_step_left_s_ += step.duration_s;  // what the last step overran counts towards this one
  alarm_gain_.target = step.frequency_Hz > 0.0 ? alarm_level_ : 0.0;
  if (step.frequency_Hz > 0.0)
    alarm_frequency_Hz_ = step.frequency_Hz;  // a pause fades out at the pitch before it
}

double ToneSynthesizer::next_percept() noexcept {
  const double gain = gain_.next(share_);
  const double log_frequency = log_frequency_.next(share_);
  if (gain < kInaudible && gain_.target <= 0.0) return 0.0;
  phase_ += std::exp(log_frequency) / sample_rate_Hz_;
  phase_ -= std::floor(phase_);
  return gain * std::sin(kTurn * phase_);
}

double ToneSynthesizer::next_alarm() noexcept {
  if (alarm_ != Alarm::kNone) {
    alarm_step_left_s_ -= 1.0 / sample_rate_Hz_;
    if (alarm_step_left_s_ <= 0.0) {
      alarm_step_ = (alarm_step_ + 1) % alarm_pattern(alarm_).size();
      begin_alarm_step();
    }
  }
  const double gain = alarm_gain_.next(share_);
  if (gain < kInaudible && alarm_gain_.target <= 0.0) return 0.0;
  alarm_phase_ += alarm_frequency_Hz_ / sample_rate_Hz_;
  alarm_phase_ -= std::floor(alarm_phase_);
  // First terms of a square wave, scaled to an amplitude of about 1: reedy, unlike the percept's pure tone.
  const double s = std::sin(kTurn * alarm_phase_), third = std::sin(3.0 * kTurn * alarm_phase_);
  return gain * (s + third / 3.0);
}

void ToneSynthesizer::render(std::span<float> mono) noexcept {
  for (float& sample : mono)
    sample = static_cast<float>(std::clamp(next_percept() + next_alarm(), -1.0, 1.0));
}

}  // namespace phantom::percept
