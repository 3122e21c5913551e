#pragma once

#include <cstdint>
#include <span>

#include "common/core/clock.hpp"
#include "common/messages/percept.hpp"
#include "common/percept/tone.hpp"
#include "common/teleop/link_state.hpp"
#include "components/audio_percept/alarm_manager.hpp"
#include "components/audio_percept/config.hpp"
#include "components/audio_percept/listener.hpp"

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
  Vector3 position_m{};    ///< of that sensor, in W
  messages::PerceptCondition condition = messages::PerceptCondition::kFresh;  ///< what it rests on
  bool muted = false;  ///< an object is touched that may be: not felt
  core::Nanoseconds sent_ns =
      0;  ///< when it was sent, where the sender has this host's clock; else received_ns
};

/// What a side says of itself.
struct LinkSample {
  core::Nanoseconds received_ns = 0;
  teleop::LinkState state = teleop::LinkState::kInit;
  core::StopCause cause = core::StopCause::kNone;  ///< while it is stopped
};

struct AlertSample {
  core::Nanoseconds raised_ns = 0;  ///< when the newest alert came
  std::uint32_t active = 0;         ///< alerts that are not over
};

/// What the operator asked for that concerns the ear.
struct CommandSample {
  core::Nanoseconds reset_ns = 0;         ///< when a reset was asked for last: what stands is known
  std::optional<percept::ViewNode> view;  ///< that was chosen, if any
};

/// How the view stands that the operator looks at.
struct ViewSample {
  core::Nanoseconds received_ns = 0;
  EarAxes axes{};
};

struct Inputs {
  core::Nanoseconds now_ns = 0;
  PerceptSample percept;
  LinkSample master, slave;
  AlertSample alerts;
  CommandSample command;
  ViewSample view;
};

/// What is to be heard, in words.
enum class Situation {
  kWaiting,    ///< no valid percept has come yet: silence
  kFreeSpace,  ///< silence
  kSounding,   ///< near an object
  kStale       ///< a percept that was there is not any more: silence and alarm
};

/// From the newest samples to sound: tone law, direction, staleness and alarms; renders one period a step.
class AudioPercept {
 public:
  explicit AudioPercept(const AudioPerceptConfig& config);

  /// Renders the next samples, usually kPeriodFrames, of the percept and of the alarms; both spans of one
  /// length. Real-time safe: yes.
  void step(const Inputs& inputs, std::span<float> percept, std::span<float> alarm) noexcept;

  Situation situation() const noexcept { return situation_; }
  /// The gravest alarm that stands, whether it sounds at this moment or not.
  percept::Alarm alarm() const noexcept { return alarms_.standing(); }
  /// The alarm whose burst is being played.
  percept::Alarm sounding() const noexcept { return synthesizer_.alarm(); }
  std::uint64_t bursts() const noexcept { return alarms_.bursts(); }
  const percept::Tone& tone() const noexcept { return tone_; }
  /// Where the percept is heard, in the ears' frame.
  const Vector3& heard_from() const noexcept { return heard_from_; }

 private:
  Situation assess(const Inputs& inputs) noexcept;
  AlarmSet conditions(const Inputs& inputs) const noexcept;
  bool link_lost(const LinkSample& link, core::Nanoseconds now_ns) const noexcept;
  EarAxes facing(const Inputs& inputs) const noexcept;
  void turn_to(const Inputs& inputs, double dt_s) noexcept;

  AudioPerceptConfig config_;
  percept::ToneSynthesizer synthesizer_;
  AlarmManager alarms_;
  percept::Tone tone_;
  Vector3 heard_from_{0.0, 0.0, -1.0};
  Situation situation_ = Situation::kWaiting;
  bool heard_ = false;  // whether a valid percept has ever come
  core::Nanoseconds reset_ns_ = 0;
};

}  // namespace phantom::audio_percept
