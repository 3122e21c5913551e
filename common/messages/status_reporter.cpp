#include "common/messages/status_reporter.hpp"

#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <map>

#include "common/core/host/host_interfaces.hpp"
#include "common/core/progress.hpp"
#include "common/core/service_manager.hpp"

namespace phantom::messages {
namespace {

/// Adds each hung reader as a loop: a reader whose callback does not return receives nothing more.
void add_hung_readers(ComponentStatus& status) {
  for (const core::EndpointStatistics& endpoint : status.topics) {
    core::LoopStatistics reader{.name = endpoint.topic + " reader",
                                .ticks = endpoint.samples,
                                .idle_s = endpoint.busy_s,
                                .limit_s = core::Progress::kHangsAfter_s};
    if (core::hangs(reader)) status.loops.push_back(std::move(reader));
  }
}

/// Adds how many datagrams were refused for each reason that there was, and then, as far as the topic has
/// room, who sent most of them: the greatest first.
void add_refused(const std::vector<dds::Participant*>& participants,
                 std::vector<core::HealthFigure>& figures) {
  std::map<wire::Fault, dds::Refused> by_fault;
  for (const dds::Participant* participant : participants) {
    for (const dds::Refused& one : participant->refused_datagrams()) {
      const auto [sum, is_first] = by_fault.try_emplace(one.fault, one);
      if (is_first) continue;
      sum->second.count += one.count;
      if (one.greatest.count > sum->second.greatest.count) sum->second.greatest = one.greatest;
    }
  }
  std::vector<dds::Refused> refused;
  for (const auto& [fault, sum] : by_fault) {
    figures.push_back(
        {std::string("refused: ") + wire::words_of(fault), static_cast<double>(sum.count), "datagrams"});
    refused.push_back(sum);
  }
  std::sort(refused.begin(), refused.end(),
            [](const dds::Refused& a, const dds::Refused& b) { return a.greatest.count > b.greatest.count; });
  for (const dds::Refused& one : refused)
    figures.push_back({std::string("refused from: ") + wire::words_of(one.fault),
                       static_cast<double>(one.greatest.count), dds::address_text(one.greatest.address)});
}

/// Adds what the participant has forgotten to the component's own figure, or as one where there is none.
void add_forgotten(const dds::Participant& participant, std::vector<core::HealthFigure>& figures) {
  const auto count = static_cast<double>(participant.forgotten());
  const auto own = std::find_if(figures.begin(), figures.end(),
                                [](const core::HealthFigure& figure) { return figure.name == kForgotten; });
  if (own != figures.end()) own->value += count;
  if (own == figures.end() && count > 0) figures.push_back({kForgotten, count, ""});
}

}  // namespace

StatusReporter::StatusReporter(dds::Participant& participant, const std::string& name)
    : participant_(participant),
      name_(name.empty() ? participant.component() : name),
      publisher_(participant, dds::kComponentStatus),
      guarded_{&participant} {}

/// Tells once a day in the log, too.
void StatusReporter::add_security(core::Health& health) {
  constexpr core::Nanoseconds kDay_ns = 86'400 * core::kNsPerSecond;
  if (!participant_.documents_end()) return;
  core::Health alone;
  dds::add_documents_end(alone, *participant_.documents_end(), core::utc_ns());
  if (alone.message.empty()) return;
  health.message += (health.message.empty() ? "" : "; ") + alone.message;
  health.figures.insert(health.figures.end(), alone.figures.begin(), alone.figures.end());
  if (const core::Nanoseconds now_ns = core::monotonic_ns(); now_ns >= security_quiet_until_ns_) {
    security_quiet_until_ns_ = now_ns + kDay_ns;
    spdlog::warn("{}", alone.message);
  }
}

void StatusReporter::publish(const core::Health& health) {
  ComponentStatus status{
      health, {}, name_, core::host_name(), static_cast<std::uint32_t>(getpid()), participant_.endpoints()};
  add_security(status);
  if (const std::string peer = participant_.half_known_peer(); !peer.empty())
    status.message += (status.message.empty() ? "" : "; ") + peer;
  add_hung_readers(status);
  add_forgotten(participant_, status.figures);
  add_refused(guarded_, status.figures);
  for (dds::Participant* participant : guarded_) participant->log_refused_datagrams();
  static_cast<core::Health&>(status) = core::with_hung_loops(std::move(status));
  publisher_.publish(status);
  core::notify_service_manager(
      name_of(status.state) + (status.message.empty() ? std::string() : ": " + status.message),
      !core::any_hangs(status));
}

}  // namespace phantom::messages
