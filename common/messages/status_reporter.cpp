#include "common/messages/status_reporter.hpp"

#include <unistd.h>

#include <algorithm>

#include "common/core/host_interfaces.hpp"
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

/// Adds how many datagrams were refused for each reason that there was.
void add_refused(const dds::Participant& participant, std::vector<core::HealthFigure>& figures) {
  for (const dds::Refused& one : participant.refused_datagrams())
    figures.push_back(
        {std::string("refused: ") + wire::words_of(one.fault), static_cast<double>(one.count), "datagrams"});
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

StatusReporter::StatusReporter(dds::Participant& participant)
    : participant_(participant), publisher_(participant, dds::kComponentStatus) {}

void StatusReporter::publish(const core::Health& health) {
  ComponentStatus status{health,
                         {},
                         participant_.component(),
                         core::host_name(),
                         static_cast<std::uint32_t>(getpid()),
                         participant_.endpoints()};
  add_hung_readers(status);
  add_forgotten(participant_, status.figures);
  add_refused(participant_, status.figures);
  participant_.log_refused_datagrams();
  static_cast<core::Health&>(status) = core::with_hung_loops(std::move(status));
  publisher_.publish(status);
  core::notify_service_manager(
      name_of(status.state) + (status.message.empty() ? std::string() : ": " + status.message),
      !core::any_hangs(status));
}

}  // namespace phantom::messages
