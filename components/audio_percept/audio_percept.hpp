#pragma once

#include <cstdint>
#include <span>

#include "common/core/clock.hpp"
#include "common/percept/tone.hpp"
#include "components/audio_percept/config.hpp"

namespace phantom::audio_percept {

inline constexpr double kSampleRate_Hz = 48000.0;
inline constexpr std::size_t kPeriodFrames = 240;  ///< 5 ms
inline constexpr double kPeriod_s = static_cast<double>(kPeriodFrames) / kSampleRate_Hz;

// What was heard from the topics. received_ns is this host's monotonic clock; 0: nothing yet.

struct PerceptSample {
  core::Nanoseconds received_ns = 0;
  bool valid = false;
  double closeness = 0.0;  ///< 0 free space … 1 at the surface
  double speed_m_s = 0.0;  ///< of the sensor that is nearest
};

enum class Link { kIdle, kActive, kDegraded, kStopped, kDriveFault };  ///< the last: stopped too, by its own drives

struct LinkSample {
  core::Nanoseconds received_ns = 0;
  Link state = Link::kIdle;
};

struct AlertSample {
  core::Nanoseconds raised_ns = 0;  ///< when the newest alert came
  std::uint32_t active = 0;         ///< alerts that are not over
};

struct Inputs {
  core::Nanoseconds now_ns = 0;
  PerceptSample percept;
  LinkSample master, slave;
  AlertSample alerts;
};

/// What is to be heard, in words.
enum class Situation {
  kWaiting,    ///< no valid percept has come yet: silence
  kFreeSpace,  ///< silence
  kSounding,   ///< near an object
  kStale       ///< a percept that was there is not any more: silence and alarm
};

/// From the newest samples to sound: tone law, staleness and alarms; renders one period a step.
class AudioPercept {
 public:
  explicit AudioPercept(const AudioPerceptConfig& config);

  /// Renders the next samples of the mono signal, usually kPeriodFrames. Real-time safe: yes.
  void step(const Inputs& inputs, std::span<float> mono) noexcept;

  Situation situation() const noexcept { return situation_; }
  percept::Alarm alarm() const noexcept { return synthesizer_.alarm(); }
  /// Whether an end is stopped because its drives are in fault, and nobody asked for an emergency stop.
  bool drive_fault() const noexcept { return drive_fault_; }
  const percept::Tone& tone() const noexcept { return tone_; }

 private:
  Situation judge(const Inputs& inputs) noexcept;
  percept::Alarm alarm_for(const Inputs& inputs) const noexcept;
  bool link_lost(const LinkSample& link, core::Nanoseconds now_ns) const noexcept;

  AudioPerceptConfig config_;
  percept::ToneSynthesizer synthesizer_;
  percept::Tone tone_;
  Situation situation_ = Situation::kWaiting;
  bool drive_fault_ = false;
  bool heard_ = false;  // whether a valid percept has ever come
};

}  // namespace phantom::audio_percept
