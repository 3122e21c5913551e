#include "common/dds/status_reporter.hpp"

#include <unistd.h>

#include <algorithm>

#include "common/core/progress.hpp"
#include "common/core/service_manager.hpp"

namespace phantom::dds {
namespace {

constexpr std::size_t kMaxLoops = 8, kMaxTopics = 32, kMaxFigures = 32, kMaxMessage = 256, kMaxPage = 128;

msg::ComponentState to_msg(core::ComponentState state) {
  switch (state) {
    case core::ComponentState::kStarting:
      return msg::COMPONENT_STARTING;
    case core::ComponentState::kReady:
      return msg::COMPONENT_READY;
    case core::ComponentState::kRunning:
      return msg::COMPONENT_RUNNING;
    case core::ComponentState::kDegraded:
      return msg::COMPONENT_DEGRADED;
    case core::ComponentState::kStopped:
      return msg::COMPONENT_STOPPED;
    case core::ComponentState::kFault:
      return msg::COMPONENT_FAULT;
  }
  return msg::COMPONENT_FAULT;
}

msg::LoopStatistics to_msg(const core::LoopStatistics& loop) {
  msg::LoopStatistics out;
  out.name(loop.name.substr(0, 32));
  out.period_s(loop.period_s);
  out.rate_hz(loop.rate_hz);
  out.idle_s(loop.idle_s);
  out.wakeup_p50_us(loop.wakeup_p50_us);
  out.wakeup_p99_us(loop.wakeup_p99_us);
  out.wakeup_max_us(loop.wakeup_max_us);
  out.work_p50_us(loop.work_p50_us);
  out.work_max_us(loop.work_max_us);
  out.ticks(loop.ticks);
  out.slips(loop.slips);
  return out;
}

msg::TopicStatistics to_msg(const EndpointStatistics& endpoint) {
  msg::TopicStatistics out;
  out.topic(endpoint.topic);
  out.writer(endpoint.writer);
  out.matched(endpoint.matched);
  out.samples(endpoint.samples);
  out.refused(endpoint.refused);
  out.deadline_missed(endpoint.deadline_missed);
  out.liveliness_lost(endpoint.liveliness_lost);
  out.incompatible_qos(endpoint.incompatible_qos);
  return out;
}

msg::Figure to_msg(const core::HealthFigure& figure) {
  msg::Figure out;
  out.name(figure.name.substr(0, 64));
  out.value(figure.value);
  out.unit(figure.unit.substr(0, 16));
  return out;
}

template <class In>
auto converted(const In& items, std::size_t limit) {
  std::vector<decltype(to_msg(items.front()))> out;
  for (std::size_t i = 0; i < std::min(items.size(), limit); ++i) out.push_back(to_msg(items[i]));
  return out;
}

std::string state_name(core::ComponentState state) {
  constexpr const char* kNames[] = {"starting", "ready", "running", "degraded", "stopped", "fault"};
  return kNames[static_cast<std::size_t>(state)];
}

/// Adds each hung reader as a loop: a reader whose callback does not return receives nothing more.
core::Health with_hung_readers(core::Health health, const std::vector<EndpointStatistics>& endpoints) {
  for (const EndpointStatistics& endpoint : endpoints) {
    core::LoopStatistics reader{.name = endpoint.topic + " reader",
                                .ticks = endpoint.samples,
                                .idle_s = endpoint.busy_s,
                                .limit_s = core::Progress::kHangsAfter_s};
    if (core::hangs(reader)) health.loops.push_back(std::move(reader));
  }
  return health;
}

}  // namespace

std::string host_name() {
  char name[65] = {};
  gethostname(name, sizeof name - 1);
  return name;
}

StatusReporter::StatusReporter(Participant& participant)
    : participant_(participant),
      stamper_(participant),
      writer_(participant, kComponentStatus),
      host_(host_name()) {}

void StatusReporter::publish(const core::Health& told) {
  const std::vector<EndpointStatistics> endpoints = participant_.endpoints();
  const core::Health health = core::with_hung_loops(with_hung_readers(told, endpoints));
  msg::ComponentStatus status;
  status.component_name(participant_.component());
  status.host(host_);
  status.stamp(stamper_.next());
  status.process_id(static_cast<std::uint32_t>(getpid()));
  status.state(to_msg(health.state));
  status.message(health.message.substr(0, kMaxMessage));
  status.loops(converted(health.loops, kMaxLoops));
  status.topics(converted(endpoints, kMaxTopics));
  status.figures(converted(health.figures, kMaxFigures));
  if (health.page.size() <= kMaxPage) status.page(health.page);
  writer_.write(status);
  core::notify_service_manager(
      state_name(health.state) + (health.message.empty() ? "" : ": " + health.message),
      !core::any_hangs(health));
}

}  // namespace phantom::dds
