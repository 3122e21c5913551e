#pragma once

#include <cstdint>
#include <span>

#include "common/core/clock.hpp"
#include "common/messages/percept.hpp"
#include "common/messages/teleoperation.hpp"
#include "common/percept/tone.hpp"
#include "common/teleop/coupling/link_state.hpp"
#include "components/audio_percept/alarm_manager.hpp"
#include "components/audio_percept/config.hpp"
#include "components/audio_percept/listener.hpp"

namespace phantom::audio_percept {

inline constexpr double kSampleRate_Hz = 48000.0;
inline constexpr std::size_t kPeriodFrames = 240;  ///< 5 ms
inline constexpr double kPeriod_s = static_cast<double>(kPeriodFrames) / kSampleRate_Hz;

// What is kept of topics. received_ns is this host's monotonic clock; 0: nothing received yet.

struct AlertSample {
  core::Nanoseconds raised_ns = 0;  ///< time of the newest alert
  std::uint32_t active = 0;         ///< number of alerts that have not been cleared
};

/// The operator's commands that concern the sound.
struct CommandSample {
  /// Time of the operator's last reset, which acknowledges the present alarms.
  core::Nanoseconds reset_ns = 0;
  std::optional<percept::ViewNode> view;  ///< the chosen view node, if any
};

/// The orientation of the view that the operator looks at.
struct ViewSample {
  core::Nanoseconds received_ns = 0;
  ListenerAxes axes{};
};

/// The newest of all topics.
struct Inputs {
  core::Nanoseconds now_ns = 0;
  messages::Received<messages::Percept> percept;
  messages::Received<messages::MasterState> master;
  messages::Received<messages::SlaveState> slave;
  AlertSample alerts;
  CommandSample command;
  ViewSample view;
};

/// Returns when a percept was sent, if its sender shares this host's clock; else when it was received.
/// Real-time safe: yes.
core::Nanoseconds sent_ns(const messages::Received<messages::Percept>& percept) noexcept;

/// What is to be heard.
enum class Situation {
  kWaiting,    ///< no valid percept has come yet: silence
  kFreeSpace,  ///< silence
  kSounding,   ///< tone: near an object
  kOff,        ///< the operator works without the tone: silence, but alarms as ever
  kStale       ///< a percept was valid before and is not now: silence and alarm
};

/// Turns the newest samples into sound: tone law, direction, staleness and alarms. Each step renders one
/// period.
class AudioPercept {
 public:
  explicit AudioPercept(const AudioPerceptConfig& config);

  /// Renders the next samples, usually kPeriodFrames, of the percept and of the alarms. Both spans have the
  /// same length. Real-time safe: yes.
  void step(const Inputs& inputs, std::span<float> percept, std::span<float> alarm) noexcept;

  Situation situation() const noexcept { return situation_; }
  /// Returns the most serious alarm present, whether it sounds at this moment or not.
  percept::Alarm alarm() const noexcept { return alarms_.active(); }
  /// Returns the alarm whose burst is being played.
  percept::Alarm sounding() const noexcept { return synthesizer_.alarm(); }
  std::uint64_t bursts() const noexcept { return alarms_.bursts(); }
  const percept::Tone& tone() const noexcept { return tone_; }
  /// Returns the position from which the percept is heard, in the frame of the listener.
  const Vector3& source_position() const noexcept { return source_position_; }

 private:
  Situation assess(const Inputs& inputs) noexcept;
  AlarmSet conditions(const Inputs& inputs) const noexcept;
  bool link_lost(const auto& side, core::Nanoseconds now_ns) const noexcept;
  ListenerAxes facing(const Inputs& inputs) const noexcept;
  void turn_to(const Inputs& inputs, double dt_s) noexcept;

  AudioPerceptConfig config_;
  percept::ToneSynthesizer synthesizer_;
  AlarmManager alarms_;
  percept::Tone tone_;
  Vector3 source_position_{0.0, 0.0, -1.0};
  Situation situation_ = Situation::kWaiting;
  bool had_percept_ = false;  // whether a valid percept has ever come
  core::Nanoseconds reset_ns_ = 0;
};

}  // namespace phantom::audio_percept
