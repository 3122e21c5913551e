#include "components/audio_percept/audio_percept.hpp"

namespace phantom::audio_percept {

namespace {

bool stands(Link state, const Inputs& inputs) noexcept {
  return inputs.master.state == state || inputs.slave.state == state;
}

}  // namespace

AudioPercept::AudioPercept(const AudioPerceptConfig& config)
    : config_(config), synthesizer_(kSampleRate_Hz, config.smoothing_s, config.alarm_gain) {}

Situation AudioPercept::judge(const Inputs& inputs) noexcept {
  const PerceptSample& sample = inputs.percept;
  const bool fresh =
      sample.received_ns > 0 && inputs.now_ns - sample.received_ns <= config_.percept_timeout_ns;
  if (!fresh || !sample.valid) return heard_ ? Situation::kStale : Situation::kWaiting;
  heard_ = true;
  return sample.closeness > 0.0 ? Situation::kSounding : Situation::kFreeSpace;
}

bool AudioPercept::link_lost(const LinkSample& link, core::Nanoseconds now_ns) const noexcept {
  if (link.received_ns == 0) return false;  // not there yet: nothing is lost
  return link.state == Link::kDegraded || now_ns - link.received_ns > config_.link_timeout_ns;
}

percept::Alarm AudioPercept::alarm_for(const Inputs& inputs) const noexcept {
  if (stands(Link::kStopped, inputs) || stands(Link::kDriveFault, inputs)) return percept::Alarm::kStopped;
  if (situation_ == Situation::kStale || link_lost(inputs.master, inputs.now_ns) ||
      link_lost(inputs.slave, inputs.now_ns)) {
    return percept::Alarm::kLinkLost;
  }
  const bool recent = inputs.now_ns - inputs.alerts.raised_ns <= config_.unsafe_alarm_ns;
  return inputs.alerts.active > 0 && recent ? percept::Alarm::kUnsafeMotion : percept::Alarm::kNone;
}

void AudioPercept::step(const Inputs& inputs, std::span<float> mono) noexcept {
  situation_ = judge(inputs);
  tone_ = situation_ == Situation::kSounding
              ? percept::tone_of(config_.law, inputs.percept.closeness, inputs.percept.speed_m_s)
              : percept::Tone{};
  synthesizer_.set_tone(tone_);
  drive_fault_ = stands(Link::kDriveFault, inputs) && !stands(Link::kStopped, inputs);
  synthesizer_.set_alarm(alarm_for(inputs));
  synthesizer_.render(mono);
}

}  // namespace phantom::audio_percept
