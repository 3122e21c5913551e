#include "common/messages/status_reporter.hpp"

#include <unistd.h>

#include <map>

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
void add_refused(const std::vector<dds::Participant*>& participants,
                 std::vector<core::HealthFigure>& figures) {
  std::map<wire::Fault, std::uint64_t> counts;
  for (const dds::Participant* participant : participants) {
    for (const dds::Refused& one : participant->refused_datagrams()) counts[one.fault] += one.count;
  }
  for (const auto& [fault, count] : counts)
    figures.push_back(
        {std::string("refused: ") + wire::words_of(fault), static_cast<double>(count), "datagrams"});
}

}  // namespace

StatusReporter::StatusReporter(dds::Participant& participant)
    : participant_(participant), publisher_(participant, dds::kComponentStatus), guarded_{&participant} {}

void StatusReporter::publish(const core::Health& health) {
  ComponentStatus status{health,
                         {},
                         participant_.component(),
                         core::host_name(),
                         static_cast<std::uint32_t>(getpid()),
                         participant_.endpoints()};
  add_hung_readers(status);
  add_refused(guarded_, status.figures);
  for (dds::Participant* participant : guarded_) participant->log_refused_datagrams();
  static_cast<core::Health&>(status) = core::with_hung_loops(std::move(status));
  publisher_.publish(status);
  core::notify_service_manager(
      name_of(status.state) + (status.message.empty() ? std::string() : ": " + status.message),
      !core::any_hangs(status));
}

}  // namespace phantom::messages
