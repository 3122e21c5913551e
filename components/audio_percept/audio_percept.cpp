#include "components/audio_percept/audio_percept.hpp"

#include <cmath>

#include "common/core/elapsed.hpp"

namespace phantom::audio_percept {

namespace {

using percept::Alarm;

// Time constant with which the percept moves to another place: too fast for the ear to follow, too slow to
// click.
constexpr double kTurnTime_s = 0.030;

using messages::PerceptCondition;
using teleop::LinkState;

/// Returns whether master or slave is stopped: by a drive fault if `by_drives`, else for another reason.
bool stopped(const Inputs& inputs, bool by_drives) noexcept {
  const auto holds = [by_drives](const auto& side) {
    return side.state == LinkState::kStopped &&
           (side.stop.cause == teleop::StopCause::kDriveFault) == by_drives;
  };
  return holds(inputs.master) || holds(inputs.slave);
}

/// Returns whether the percept is valid but its workspace may lag behind the cell.
bool aged(PerceptCondition condition) noexcept {
  return condition == PerceptCondition::kWorkspaceUnattended ||
         condition == PerceptCondition::kWorkspaceBehind;
}
/// Returns whether the percept is invalid because the workspace is missing or too old.
bool workspace_lost(PerceptCondition condition) noexcept {
  return condition == PerceptCondition::kWorkspaceStale || condition == PerceptCondition::kNoWorkspace;
}

/// Returns the time to contact of the most urgent threat; −1: none nears.
double soonest_contact_s(const messages::Percept& percept) noexcept {
  return percept.threats.empty() ? -1.0 : percept.threats.front().contact.time_s;
}

}  // namespace

// The clocks of two hosts differ by more than a second, because the hosts were not started within the same
// second.
core::Nanoseconds sent_ns(const messages::Received<messages::Percept>& percept) noexcept {
  const core::Nanoseconds age_ns = core::elapsed_ns(percept.stamp.monotonic_ns, percept.received_ns);
  const bool same_clock = age_ns >= 0 && age_ns <= core::from_seconds(1.0);
  return same_clock ? percept.stamp.monotonic_ns : percept.received_ns;
}

AudioPercept::AudioPercept(const AudioPerceptConfig& config)
    : config_(config),
      synthesizer_(kSampleRate_Hz, config.smoothing_s, config.alarm_gain),
      alarms_(config.alarms) {}

Situation AudioPercept::assess(const Inputs& inputs) noexcept {
  const auto& sample = inputs.percept;
  const bool fresh =
      sample.received_ns > 0 && inputs.now_ns - sample.received_ns <= config_.percept_timeout_ns;
  if (!fresh || !sample.valid) return had_percept_ ? Situation::kStale : Situation::kWaiting;
  had_percept_ = true;
  // Only a master that is heard can do without the tone: otherwise the operator is warned.
  const bool heard = inputs.now_ns - inputs.master.received_ns <= config_.link_timeout_ns;
  if (heard && !inputs.master.tone_enabled) return Situation::kOff;
  return sample.closeness > 0.0 ? Situation::kSounding : Situation::kFreeSpace;
}

bool AudioPercept::link_lost(const auto& side, core::Nanoseconds now_ns) const noexcept {
  if (side.received_ns == 0) return false;  // never heard, so not lost
  return side.state == LinkState::kDegraded || now_ns - side.received_ns > config_.link_timeout_ns;
}

AlarmSet AudioPercept::conditions(const Inputs& inputs) const noexcept {
  const auto& sample = inputs.percept;
  const bool stale = situation_ == Situation::kStale;
  const bool fresh =
      sample.received_ns > 0 && inputs.now_ns - sample.received_ns <= config_.percept_timeout_ns;
  const bool model_lost =
      fresh && !sample.valid &&
      (sample.condition == PerceptCondition::kSelfTestFailed || (stale && workspace_lost(sample.condition)));
  const bool recent =
      inputs.alerts.active > 0 && inputs.now_ns - inputs.alerts.raised_ns <= config_.unsafe_alarm_ns;
  AlarmSet set;
  const auto put = [&set](Alarm alarm, bool holds) { set[static_cast<std::size_t>(alarm)] = holds; };
  put(Alarm::kEmergencyStop, stopped(inputs, false));
  put(Alarm::kDriveFault, stopped(inputs, true));
  put(Alarm::kUnsafeMotion, recent);
  put(Alarm::kLinkLost, (stale && !model_lost) || link_lost(inputs.master, inputs.now_ns) ||
                            link_lost(inputs.slave, inputs.now_ns));
  put(Alarm::kWorkspaceStale, model_lost);
  put(Alarm::kWorkspaceAged, fresh && sample.valid && aged(sample.condition));
  put(Alarm::kMutedContact, fresh && sample.valid && sample.muted_sensors > 0);
  return set;
}

/// Returns the orientation of the listener: as the viewer reports it, else as the operator chose, else as
/// configured.
ListenerAxes AudioPercept::facing(const Inputs& inputs) const noexcept {
  const ListenerConfig& listener = config_.listener;
  const bool follows_view = listener.follow_viewer && inputs.view.received_ns > 0 &&
                            inputs.now_ns - inputs.view.received_ns <= listener.view_timeout_ns;
  if (follows_view) return inputs.view.axes;
  const bool chosen = listener.follow_operator && inputs.command.view;
  return listener_axes(listener, chosen ? inputs.command.view : listener.view);
}

void AudioPercept::turn_to(const Inputs& inputs, double dt_s) noexcept {
  const Vector3 target = in_listener_frame(config_.listener, facing(inputs), inputs.percept.position_m);
  const double share = tone_.gain > 0.0 ? 1.0 - std::exp(-dt_s / kTurnTime_s) : 1.0;
  for (std::size_t i = 0; i < 3; ++i) source_position_[i] += share * (target[i] - source_position_[i]);
}

void AudioPercept::step(const Inputs& inputs, std::span<float> percept, std::span<float> alarm) noexcept {
  const double dt_s = static_cast<double>(percept.size()) / kSampleRate_Hz;
  situation_ = assess(inputs);
  if (situation_ == Situation::kSounding) turn_to(inputs, dt_s);
  tone_ = situation_ == Situation::kSounding
              ? percept::tone_of(config_.law, inputs.percept.closeness, inputs.percept.speed_m_s,
                                 soonest_contact_s(inputs.percept))
              : percept::Tone{};
  synthesizer_.set_tone(tone_);
  const bool acknowledged = inputs.command.reset_ns != reset_ns_;
  reset_ns_ = inputs.command.reset_ns;
  if (const auto change = alarms_.step(conditions(inputs), acknowledged, dt_s))
    synthesizer_.start_alarm(*change);
  synthesizer_.render(percept, alarm);
}

}  // namespace phantom::audio_percept
