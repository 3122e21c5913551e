#pragma once

#include <cmath>
#include <cstddef>
#include <span>

namespace phantom::percept {

/// How closeness maps to pitch.
enum class PitchLaw {
  kExponential,  ///< equal steps of closeness are equal musical intervals
  kLinear        ///< equal steps of closeness are equal steps in hertz
};

/// Dual-function tone law (spec 4.1): pitch codes closeness, level codes speed. Constant after configuration.
struct ToneLaw {
  PitchLaw pitch = PitchLaw::kExponential;
  double min_frequency_Hz = 220.0;   ///< at the outer rim of the outermost layer, > 0
  double max_frequency_Hz = 1760.0;  ///< at the surface, > min_frequency_Hz
  double rest_gain = 0.08;           ///< amplitude at standstill near an object, 0 < rest ≤ full
  double full_gain = 0.6;            ///< amplitude at full_speed_m_s and above, ≤ 1
  double full_speed_m_s = 0.25;      ///< > 0
  double speed_exponent = 0.5;       ///< < 1 spreads the slow motions, > 0
  bool equal_loudness = true;  ///< level the ear's sensitivity over the pitch range (see loudness_factor)
};

/// A sine: frequency and amplitude (1 = full scale).
struct Tone {
  double frequency_Hz = 0.0;
  double gain = 0.0;
};

/// Tone of a sensor at `closeness` (0 free space … 1 at the surface, clamped) moving at `speed_m_s` (≥ 0).
/// Gain is 0 only in free space. Values that are not finite give silence. Real-time safe: yes.
Tone tone_of(const ToneLaw& law, double closeness, double speed_m_s) noexcept;

/// Amplitude factor, at most 1, that levels perceived loudness over the law's pitch range: the inverse of the
/// A-weighting curve (IEC 61672-1), scaled so that the pitch the ear hears least keeps its whole amplitude. A
/// first-order stand-in for the loudness contours of ISO 226. 1 if the law does not ask for it. Real-time
/// safe: yes.
double loudness_factor(const ToneLaw& law, double frequency_Hz) noexcept;

/// States that sound apart from the percept: pulsed, with odd harmonics, where the percept is a continuous
/// pure tone.
enum class Alarm {
  kNone,
  kUnsafeMotion,  ///< fast high pulses
  kLinkLost,      ///< two falling beeps every other second
  kStopped  ///< two-tone siren without a pause
};

/// One step of an alarm's pattern; the pattern repeats.
struct AlarmStep {
  double frequency_Hz = 0.0;  ///< 0: pause
  double duration_s = 0.0;
};
/// Steps of `alarm`; empty for kNone. Real-time safe: yes.
std::span<const AlarmStep> alarm_pattern(Alarm alarm) noexcept;

/// Renders a percept tone and an alarm as one mono signal. Pitch and level follow their targets through two
/// equal first-order filters in series (smoothing_s in all), so that jumps of the targets neither click nor
/// lag audibly; both phases are continuous. Never outside ±1 while full_gain + alarm_gain ≤ 1. Not
/// thread-safe.
class ToneSynthesizer {
 public:
  explicit ToneSynthesizer(double sample_rate_Hz = 48000.0, double smoothing_s = 0.010,
                           double alarm_gain = 0.3);

  /// What the sound glides to. From silence the pitch is taken at once, so that a sound does not begin with a
  /// sweep. A tone of gain 0 fades out at the pitch it has. Values that are not finite count as silence.
  /// Real-time safe: yes.
  void set_tone(const Tone& tone) noexcept;
  /// Starts the alarm's pattern from its beginning if it is not the one that sounds. Real-time safe: yes.
  void set_alarm(Alarm alarm) noexcept;
  Alarm alarm() const noexcept { return alarm_; }
  /// The next samples. Real-time safe: yes.
  void render(std::span<float> mono) noexcept;

 private:
  /// Value that glides to its target without a corner.
  struct Glide {
    double target = 0.0, first = 0.0, value = 0.0;
    void snap(double to) noexcept { target = first = value = to; }
    double next(double share) noexcept {
      first += share * (target - first);
      value += share * (first - value);
      if (std::abs(target - first) < 1e-9 && std::abs(target - value) < 1e-9)
        first = value = target;  // no denormals
      return value;
    }
  };
  double next_percept() noexcept;
  double next_alarm() noexcept;
  void begin_alarm_step() noexcept;

  double sample_rate_Hz_, share_, alarm_level_;
  Glide log_frequency_, gain_, alarm_gain_;
  double phase_ = 0.0, alarm_phase_ = 0.0;  // turns, 0…1
  Alarm alarm_ = Alarm::kNone;
  std::size_t alarm_step_ = 0;
  double alarm_step_left_s_ = 0.0, alarm_frequency_Hz_ = 0.0;
};

}  // namespace phantom::percept
