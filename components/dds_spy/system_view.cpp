#include "components/dds_spy/system_view.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace phantom::dds_spy {
namespace {

using diagnostics::duration_text;
using diagnostics::EndpointInfo;
using diagnostics::Guid;

constexpr const char* kStatusType = "phantom::msg::ComponentStatus";

std::string instance_text(const std::string& instance) { return instance.empty() ? "" : " of " + instance; }

std::string milliseconds(core::Nanoseconds ns) {
  return fmt::format("{:.1f} ms", static_cast<double>(ns) * 1e-6);
}

}  // namespace

void SystemView::say(EventKind kind, core::Nanoseconds utc_ns, const std::string& topic,
                     const std::string& who, std::string text) {
  events_.add({.utc_ns = utc_ns, .kind = kind, .topic = topic, .who = who, .text = std::move(text)});
}

void SystemView::on_participant(const diagnostics::ParticipantInfo& participant, Change change,
                                core::Nanoseconds utc_ns) {
  if (change == Change::kAppeared || change == Change::kChanged) {
    graph_.put(participant);
    if (change == Change::kAppeared)
      say(EventKind::kParticipantJoined, utc_ns, "", graph_.who(participant.guid),
          "joined" + (participant.host.empty() ? "" : " from " + participant.host) + ", " +
              participant.vendor);
    return;
  }
  const auto* known = graph_.participant(participant.guid);
  if (known == nullptr) return;
  const std::string who = graph_.who(participant.guid);
  if (change == Change::kLeft) {
    say(EventKind::kParticipantLeft, utc_ns, "", who, "left");
  } else {
    say(EventKind::kParticipantLost, utc_ns, "", who,
        "silent for its lease of " + duration_text(known->lease_ns) + ": killed, frozen or cut off");
  }
  graph_.remove(participant.guid);
  std::erase_if(writers_, [&](const auto& item) {
    return diagnostics::participant_of(item.first) == participant.guid;
  });
  report_disagreements(utc_ns);
}

void SystemView::on_endpoint(const EndpointInfo& endpoint, Change change, core::Nanoseconds utc_ns) {
  const bool here = change == Change::kAppeared || change == Change::kChanged;
  const auto* known = graph_.endpoint(endpoint.guid);
  if (!here && known == nullptr) return;
  const EndpointInfo meant = here ? endpoint : *known;
  const bool new_here = here && known == nullptr;
  if (here) {
    graph_.put(endpoint);
  } else {
    graph_.remove(endpoint.guid);
    writers_.erase(endpoint.guid);
  }
  if (new_here || !here) {
    const EventKind kind = meant.writer ? (here ? EventKind::kWriterJoined : EventKind::kWriterLeft)
                                        : (here ? EventKind::kReaderJoined : EventKind::kReaderLeft);
    say(kind, utc_ns, meant.topic, graph_.who(meant.guid),
        fmt::format("{} of {}: {}", meant.writer ? "writer" : "reader", meant.type,
                    here ? diagnostics::qos_text(meant.qos) : "gone"));
  }
  report_disagreements(utc_ns);
}

void SystemView::report_disagreements(core::Nanoseconds utc_ns) {
  std::map<Pair, bool> now;
  for (const auto& found : graph_.disagreements()) {
    const Pair pair{found.writer->guid, found.reader->guid};
    now[pair] = true;
    if (disagreeing_.contains(pair)) continue;
    std::string text = "do not communicate:";
    for (const auto& reason : found.reasons)
      text += fmt::format(" {}, offered {}, requested {};", reason.policy, reason.offered, reason.requested);
    text += " see dds_spy qos";
    say(EventKind::kQosMismatch, utc_ns, found.writer->topic,
        graph_.who(pair.first) + " → " + graph_.who(pair.second), std::move(text));
  }
  disagreeing_ = std::move(now);
}

HeardWriter& SystemView::writer(const HeardSample& sample) {
  auto& heard = writers_[sample.writer];
  heard.topic = sample.topic;
  return heard;
}

void SystemView::on_sample(const HeardSample& sample) {
  HeardWriter& heard = writer(sample);
  const core::Nanoseconds utc_ns = sample.facts.received_utc_ns;
  if (sample.gone) {
    heard.stream.take_number(sample.facts.sequence_number);
    say(EventKind::kInstanceGone, utc_ns, sample.topic, graph_.who(sample.writer),
        "an instance is disposed of or has no writer any more");
    return;
  }
  report_arrival(sample, heard.stream.take(sample.facts));
  ++heard.instances[sample.instance];
  watch_deadline(heard, sample);
  if (!sample.problem.empty()) {
    ++heard.undecodable;
    say(EventKind::kUndecodable, utc_ns, sample.topic, graph_.who(sample.writer), sample.problem);
  }
  const auto* endpoint = graph_.endpoint(sample.writer);
  if (!sample.content || endpoint == nullptr || endpoint->type != kStatusType) return;
  for (Event& event : status_.take(*sample.content)) {
    event.utc_ns = utc_ns;
    events_.add(std::move(event));
  }
}

void SystemView::report_arrival(const HeardSample& sample, const Arrival& arrival) {
  const core::Nanoseconds utc_ns = sample.facts.received_utc_ns;
  const std::string who = graph_.who(sample.writer);
  if (arrival.missing > 0) {
    say(EventKind::kGap, utc_ns, sample.topic, who,
        fmt::format("{} sample{} did not come before number {}", arrival.missing,
                    arrival.missing == 1 ? "" : "s", sample.facts.sequence_number));
  }
  if (arrival.skipped > 0) {
    say(EventKind::kSkip, utc_ns, sample.topic, who,
        fmt::format("the writer left out {} number{} of its stamp before {}", arrival.skipped,
                    arrival.skipped == 1 ? "" : "s", sample.facts.stamp->sequence_number));
  }
  if (arrival.restarted) {
    say(EventKind::kRestart, utc_ns, sample.topic, who,
        fmt::format("a new session of the writer's process, {:016x}", sample.facts.stamp->session));
  }
}

void SystemView::watch_deadline(HeardWriter& heard, const HeardSample& sample) {
  const auto* endpoint = graph_.endpoint(sample.writer);
  if (endpoint == nullptr || endpoint->qos.deadline_ns == diagnostics::kInfinite_ns) return;
  auto& watch = heard.deadlines.try_emplace(sample.instance, endpoint->qos.deadline_ns).first->second;
  const auto made_ns = sample.facts.stamp ? sample.facts.stamp->monotonic_ns : sample.facts.source_ns;
  const auto miss = watch.take(sample.facts.received_ns, made_ns);
  if (!miss) return;
  heard.deadlines_missed += miss->periods;
  std::string text = fmt::format("{}{} between two samples{} (deadline offered: {})",
                                 miss->told ? "samples come again, " : "", milliseconds(miss->pause_ns),
                                 instance_text(sample.instance), duration_text(watch.period_ns()));
  if (miss->made_apart_ns > 0) {
    const bool late_writer = miss->made_apart_ns > watch.period_ns();
    text += fmt::format("; they were made {} apart: {}", milliseconds(miss->made_apart_ns),
                        late_writer ? "the writer was late" : "held up on the way or in this process");
  }
  say(miss->told ? EventKind::kDeadlineMet : EventKind::kDeadlineMissed, sample.facts.received_utc_ns,
      sample.topic, graph_.who(sample.writer), std::move(text));
}

void SystemView::on_liveliness(const Guid& guid, bool alive, core::Nanoseconds utc_ns) {
  const auto* endpoint = graph_.endpoint(guid);
  if (endpoint == nullptr) return;  // discovery has already reported its end
  auto& heard = writers_[guid];
  heard.topic = endpoint->topic;
  if (heard.alive == alive) return;
  heard.alive = alive;
  if (alive) {
    say(EventKind::kLivelinessBack, utc_ns, endpoint->topic, graph_.who(guid),
        "the writer proves again that it lives");
    return;
  }
  ++heard.liveliness_lost;
  say(EventKind::kLivelinessLost, utc_ns, endpoint->topic, graph_.who(guid),
      fmt::format("no proof of life for the lease of {} ({}): the writer hangs, was killed or is cut off",
                  duration_text(endpoint->qos.lease_ns), diagnostics::to_string(endpoint->qos.liveliness)));
}

void SystemView::on_reader_made(const std::string& topic) {
  for (auto& [guid, heard] : writers_) {
    if (heard.topic != topic) continue;
    heard.stream.forget_sequence();
    heard.deadlines.clear();
  }
}

void SystemView::look(core::Nanoseconds now_ns, core::Nanoseconds utc_ns) {
  for (auto& [guid, heard] : writers_) {
    for (auto& [instance, watch] : heard.deadlines) {
      const auto miss = watch.look(now_ns);
      if (!miss) continue;
      say(EventKind::kDeadlineMissed, utc_ns, heard.topic, graph_.who(guid),
          fmt::format("nothing{} for {} (deadline offered: {})", instance_text(instance),
                      milliseconds(miss->pause_ns), duration_text(watch.period_ns())));
    }
  }
  events_.look(utc_ns);
}

void SystemView::reset_counts() {
  for (auto& [guid, heard] : writers_) {
    heard.stream = {};
    heard.instances.clear();
    heard.deadlines.clear();
    heard.deadlines_missed = heard.undecodable = heard.liveliness_lost = 0;
  }
}

}  // namespace phantom::dds_spy
