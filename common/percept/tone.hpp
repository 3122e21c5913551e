#pragma once

#include <cmath>
#include <cstddef>
#include <span>

#include "common/percept/tone_alarms.hpp"

namespace phantom::percept {

/// How a share s, 0…1, maps to a range from low to high.
enum class MappingLaw {
  kExponential,  ///< low·(high/low)^s: equal steps of s are equal musical intervals, or equal steps in
                 ///< decibels
  kPower,        ///< low + (high − low)·s^exponent
  kLinear        ///< low + (high − low)·s
};

/// Tone law: pitch encodes closeness and level encodes speed (thesis 6.5.2); the rate of pulses encodes
/// urgency, the time to contact. A rate is heard beside pitch and level and changes neither: pulses begin at
/// their level and fall to a share of it, never to silence. Steps of urgency are equal ratios of rate, as the
/// ear judges rates. Constant after configuration.
struct ToneLaw {
  MappingLaw pitch = MappingLaw::kExponential;  ///< of closeness
  double pitch_exponent = 2.0;                  ///< for pitch: kPower, > 0
  double min_frequency_Hz = 220.0;              ///< at the outer face of the outermost layer, > 0
  double max_frequency_Hz = 1760.0;             ///< at the surface, > min_frequency_Hz
  MappingLaw level = MappingLaw::kPower;        ///< of speed as a share of full_speed_m_s
  double speed_exponent = 0.5;                  ///< for level: kPower, > 0; below 1 spreads the slow motions
  double rest_gain = 0.08;                      ///< amplitude at standstill near an object, 0 < rest ≤ full
  double full_gain = 0.6;                       ///< amplitude at full_speed_m_s and above, ≤ 1
  double full_speed_m_s = 0.25;                 ///< > 0
  /// Loudness level at which all pitches sound equally loud (see loudness_factor); 0: off.
  double loudness_phon = 60.0;
  double pulses_from_s = 3.0;  ///< time to contact at which the tone begins to pulse; 0: it never does
  double pulses_full_s = 0.5;  ///< at which it pulses fastest, 0 < full < from
  double min_pulse_Hz = 1.6;   ///< rate at pulses_from_s, > 0
  double max_pulse_Hz = 9.0;   ///< rate at pulses_full_s and below; above 15 Hz pulses are roughness, no rate
  double pulse_floor = 0.3;    ///< share of the level between pulses, 0 < floor ≤ 1
};

/// A sine tone: frequency and amplitude (1 = full scale) of its pulses.
struct Tone {
  double frequency_Hz = 0.0;
  double gain = 0.0;
  double pulse_Hz = 0.0;     ///< rate of pulses; 0: steady
  double pulse_floor = 1.0;  ///< share of the amplitude between them
};

/// Returns the rate of pulses at a time to contact; 0 from the law's pulses_from_s on, and for a time that is
/// negative (nothing nears) or not a number. Real-time safe: yes.
double pulse_rate_Hz(const ToneLaw& law, double contact_s) noexcept;

/// Returns the tone of a sensor at `closeness` (0 in free space … 1 at the surface, clamped) that moves at
/// `speed_m_s` (≥ 0) and whose time to contact is `contact_s` (< 0: it does not near). The gain is 0 only in
/// free space. A closeness or speed that is not finite gives silence. Real-time safe: yes.
Tone tone_of(const ToneLaw& law, double closeness, double speed_m_s, double contact_s = -1.0) noexcept;

/// Returns the amplitude factor, at most 1, that makes all pitches of the law's range equally loud. It
/// follows the equal-loudness contour of ISO 226 at the law's loudness level, scaled so that the pitch to
/// which the ear is least sensitive keeps its full amplitude. Returns 1 if the law's loudness level is 0.
/// Real-time safe: yes.
double loudness_factor(const ToneLaw& law, double frequency_Hz) noexcept;

/// Renders a percept tone and bursts of alarms. Pitch and level follow their targets through two equal
/// first-order filters in series (smoothing_s in all), so jumps of the targets neither click nor lag audibly.
/// Both phases are continuous. The sum of tone and alarm stays within ±1 while full_gain + alarm_gain ≤ 1.
/// Not thread-safe.
class ToneSynthesizer {
 public:
  explicit ToneSynthesizer(double sample_rate_Hz = 48000.0, double smoothing_s = 0.010,
                           double alarm_gain = 0.3);

  /// Sets the tone that the sound approaches. From silence the pitch is taken at once, so that a sound does
  /// not begin with a sweep. A tone of gain 0 fades out at its present pitch. Values that are not finite
  /// count as silence. Real-time safe: yes.
  void set_tone(const Tone& tone) noexcept;
  /// Plays the burst of `alarm` once, from its beginning; a burst in progress fades out. kNone only fades
  /// out. Real-time safe: yes.
  void start_alarm(Alarm alarm) noexcept;
  /// Returns the alarm whose burst is playing. Real-time safe: yes.
  Alarm alarm() const noexcept { return alarm_; }
  /// Renders the next samples of percept and alarm separately; both spans have the same length. Real-time
  /// safe: yes.
  void render(std::span<float> percept, std::span<float> alarm) noexcept;

 private:
  /// A value that approaches its target through two first-order filters.
  struct Glide {
    double target = 0.0, first = 0.0, value = 0.0;
    void snap(double to) noexcept { target = first = value = to; }
    double next(double share) noexcept {
      first += share * (target - first);
      value += share * (first - value);
      if (std::abs(target - first) < 1e-9 && std::abs(target - value) < 1e-9)
        first = value = target;  // avoids denormals
      return value;
    }
  };
  double next_percept() noexcept;
  double next_alarm() noexcept;
  void advance_burst() noexcept;
  double next_pulse() noexcept;

  double sample_rate_Hz_, share_, alarm_level_;
  Glide log_frequency_, gain_, alarm_gain_, pulse_;
  double phase_ = 0.0, alarm_phase_ = 0.0, pulse_phase_ = 0.0;  // in turns, 0…1
  double pulse_Hz_ = 0.0, pulse_floor_ = 1.0;
  Alarm alarm_ = Alarm::kNone;
  std::size_t alarm_pulse_ = 0;
  double alarm_time_s_ = 0.0, alarm_frequency_Hz_ = 440.0;  // time since the pulse began
};

}  // namespace phantom::percept
