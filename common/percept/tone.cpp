#include "common/percept/tone.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/percept/equal_loudness.hpp"

namespace phantom::percept {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;
constexpr double kInaudible = 1e-5;  // −100 dB of full scale

double mapped(MappingLaw law, double low, double high, double exponent, double share) noexcept {
  if (law == MappingLaw::kExponential) return low * std::pow(high / low, share);
  return low + (high - low) * (law == MappingLaw::kPower ? std::pow(share, exponent) : share);
}

}  // namespace

double loudness_factor(const ToneLaw& law, double frequency_Hz) noexcept {
  if (law.loudness_phon <= 0.0) return 1.0;
  const double most_dB =
      greatest_equal_loudness_level_dB(law.min_frequency_Hz, law.max_frequency_Hz, law.loudness_phon);
  return std::min(
      1.0, std::pow(10.0, (equal_loudness_level_dB(frequency_Hz, law.loudness_phon) - most_dB) / 20.0));
}

double pulse_rate_Hz(const ToneLaw& law, double contact_s) noexcept {
  if (!(contact_s >= 0.0 && contact_s < law.pulses_from_s)) return 0.0;
  const double urgency =
      std::min(1.0, (law.pulses_from_s - contact_s) / (law.pulses_from_s - law.pulses_full_s));
  return law.min_pulse_Hz * std::pow(law.max_pulse_Hz / law.min_pulse_Hz, urgency);
}

Tone tone_of(const ToneLaw& law, double closeness, double speed_m_s, double contact_s) noexcept {
  if (!std::isfinite(closeness) || !std::isfinite(speed_m_s) || closeness <= 0.0)
    return {law.min_frequency_Hz, 0.0};
  const double frequency_Hz = mapped(law.pitch, law.min_frequency_Hz, law.max_frequency_Hz,
                                     law.pitch_exponent, std::min(closeness, 1.0));
  const double speed = std::clamp(speed_m_s / law.full_speed_m_s, 0.0, 1.0);
  const double gain = mapped(law.level, law.rest_gain, law.full_gain, law.speed_exponent, speed);
  return {frequency_Hz, gain * loudness_factor(law, frequency_Hz), pulse_rate_Hz(law, contact_s),
          law.pulse_floor};
}

ToneSynthesizer::ToneSynthesizer(double sample_rate_Hz, double smoothing_s, double alarm_gain)
    : sample_rate_Hz_(sample_rate_Hz),
      share_(1.0 -
             std::exp(-2.0 / (smoothing_s * sample_rate_Hz))),  // each filter does half of the smoothing
      alarm_level_(alarm_gain) {
  pulse_.snap(1.0);
}

void ToneSynthesizer::set_tone(const Tone& tone) noexcept {
  const bool audible = std::isfinite(tone.gain) && tone.gain > 0.0 && std::isfinite(tone.frequency_Hz) &&
                       tone.frequency_Hz > 0.0;
  gain_.target = audible ? std::min(tone.gain, 1.0) : 0.0;
  const bool pulses = audible && std::isfinite(tone.pulse_Hz) && tone.pulse_Hz > 0.0;
  if (pulses && pulse_Hz_ <= 0.0) pulse_phase_ = 0.0;  // the first begins now
  pulse_Hz_ = pulses ? tone.pulse_Hz : 0.0;
  pulse_floor_ = std::clamp(tone.pulse_floor, 0.0, 1.0);
  if (!audible) return;
  const double log_frequency = std::log(std::min(tone.frequency_Hz, 0.45 * sample_rate_Hz_));
  if (gain_.value < kInaudible) {
    log_frequency_.snap(log_frequency);
  } else {
    log_frequency_.target = log_frequency;
  }
}

void ToneSynthesizer::start_alarm(Alarm alarm) noexcept {
  alarm_ = alarm;
  alarm_pulse_ = 0;
  alarm_time_s_ = 0.0;
  alarm_gain_.target = 0.0;
}

void ToneSynthesizer::advance_burst() noexcept {
  const auto burst = alarm_burst(alarm_);
  const AlarmPulse& pulse = burst[alarm_pulse_];
  if (alarm_time_s_ < pulse.on_s) {
    alarm_frequency_Hz_ = pulse.frequency_Hz;
    alarm_gain_.target = alarm_level_ * burst_gain(alarm_);
  } else {
    alarm_gain_.target = 0.0;  // fades at its present pitch
  }
  alarm_time_s_ += 1.0 / sample_rate_Hz_;
  if (alarm_time_s_ < pulse.on_s + pulse.off_s) return;
  alarm_time_s_ -= pulse.on_s + pulse.off_s;
  if (++alarm_pulse_ == burst.size()) start_alarm(Alarm::kNone);
}

// Half of a pulse's period at its level, half at the floor; edges are as smooth as all of the sound.
double ToneSynthesizer::next_pulse() noexcept {
  pulse_phase_ += pulse_Hz_ / sample_rate_Hz_;
  pulse_phase_ -= std::floor(pulse_phase_);
  pulse_.target = pulse_Hz_ > 0.0 && pulse_phase_ >= 0.5 ? pulse_floor_ : 1.0;
  return pulse_.next(share_);
}

double ToneSynthesizer::next_percept() noexcept {
  const double pulse = next_pulse();
  const double gain = gain_.next(share_);
  const double log_frequency = log_frequency_.next(share_);
  if (gain < kInaudible && gain_.target <= 0.0) return 0.0;
  phase_ += std::exp(log_frequency) / sample_rate_Hz_;
  phase_ -= std::floor(phase_);
  return pulse * gain * std::sin(kTurn * phase_);
}

double ToneSynthesizer::next_alarm() noexcept {
  if (alarm_ != Alarm::kNone) advance_burst();
  const double gain = alarm_gain_.next(share_);
  if (gain < kInaudible && alarm_gain_.target <= 0.0) return 0.0;
  alarm_phase_ += alarm_frequency_Hz_ / sample_rate_Hz_;
  alarm_phase_ -= std::floor(alarm_phase_);
  // The first four terms of a square wave. Their sum stays below 1 and sounds reedy, unlike the percept's
  // pure tone.
  const double s = std::sin(kTurn * alarm_phase_), q = s * s;
  const double third = 3.0 - 4.0 * q;
  const double fifth = 5.0 + q * (-20.0 + 16.0 * q);
  const double seventh = 7.0 + q * (-56.0 + q * (112.0 - 64.0 * q));
  return gain * s * (1.0 + third / 3.0 + fifth / 5.0 + seventh / 7.0);
}

void ToneSynthesizer::render(std::span<float> percept, std::span<float> alarm) noexcept {
  for (float& sample : percept) sample = static_cast<float>(next_percept());
  for (float& sample : alarm) sample = static_cast<float>(next_alarm());
}

}  // namespace phantom::percept
