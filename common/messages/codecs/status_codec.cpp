#include "common/messages/codecs/status_codec.hpp"

#include "common/messages/codecs/fields_codec.hpp"

namespace phantom::messages {
namespace {

constexpr std::size_t kMaxLoops = 8, kMaxTopics = 32, kMaxFigures = 32;  // as in the IDL

constexpr auto kLoop = [](auto& codec, auto& m, auto& s) {
  codec.any(m.name(), s.name);
  codec.number("period_s", m.period_s(), s.period_s);
  codec.number("rate_hz", m.rate_hz(), s.rate_hz);
  codec.number("idle_s", m.idle_s(), s.idle_s);
  codec.number("wakeup_p50_us", m.wakeup_p50_us(), s.wakeup_p50_us);
  codec.number("wakeup_p99_us", m.wakeup_p99_us(), s.wakeup_p99_us);
  codec.number("wakeup_max_us", m.wakeup_max_us(), s.wakeup_max_us);
  codec.number("work_p50_us", m.work_p50_us(), s.work_p50_us);
  codec.number("work_max_us", m.work_max_us(), s.work_max_us);
  codec.any(m.ticks(), s.ticks);
  codec.any(m.slips(), s.slips);
};

constexpr auto kTopic = [](auto& codec, auto& m, auto& s) {
  codec.any(m.topic(), s.topic);
  codec.any(m.writer(), s.writer);
  codec.any(m.matched(), s.matched);
  codec.any(m.samples(), s.samples);
  codec.any(m.refused(), s.refused);
  codec.any(m.deadline_missed(), s.deadline_missed);
  codec.any(m.liveliness_lost(), s.liveliness_lost);
  codec.any(m.incompatible_qos(), s.incompatible_qos);
};

// A figure may have any value: one that is unknown must not hide the component that reports it.
constexpr auto kFigure = [](auto& codec, auto& m, auto& s) {
  codec.any(m.name(), s.name);
  codec.any(m.value(), s.value);
  codec.any(m.unit(), s.unit);
};

constexpr auto kComponentStatus = [](auto& codec, auto& m, auto& s) {
  codec.name("component_name", m.component_name(), s.component);
  codec.any(m.host(), s.host);
  codec.stamp(m.stamp(), s.stamp);
  codec.any(m.process_id(), s.process_id);
  codec.enumeration("state", m.state(), s.state, core::ComponentState::kFault);
  codec.any(m.message(), s.message);
  codec.list(m.loops(), s.loops, kLoop, kMaxLoops);
  codec.list(m.topics(), s.topics, kTopic, kMaxTopics);
  codec.list(m.figures(), s.figures, kFigure, kMaxFigures);
  codec.any(m.page(), s.page);
};

}  // namespace

core::Expected<ComponentStatus> from_idl(const msg::ComponentStatus& message, const ArmBounds& arm) {
  auto status = decoded<ComponentStatus>(kComponentStatus, message, arm);
  if (status && status->component.empty())
    return core::Status::invalid_argument("component_name is empty; allowed: the component's name");
  return status;
}
msg::ComponentStatus to_idl(const ComponentStatus& status) {
  auto message = encoded<msg::ComponentStatus>(kComponentStatus, status);
  // A cut address would lead nowhere.
  if (status.page.size() > message.page().max_size) message.page("");
  return message;
}

}  // namespace phantom::messages
