#include "components/dds_spy/system_view.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <utility>

namespace phantom::dds_spy {
namespace {

using diagnostics::duration_text;
using diagnostics::EndpointInfo;
using diagnostics::Guid;
using diagnostics::Presence;

constexpr const char* kStatusType = "phantom::msg::ComponentStatus";

std::string instance_text(const std::string& instance) { return instance.empty() ? "" : " of " + instance; }

std::string milliseconds(core::Nanoseconds ns) {
  return fmt::format("{:.1f} ms", static_cast<double>(ns) * 1e-6);
}

}  // namespace

void SystemView::report(EventKind kind, core::Nanoseconds utc_ns, const std::string& topic,
                        const std::string& who, std::string text) {
  events_.add({.utc_ns = utc_ns, .kind = kind, .topic = topic, .who = who, .text = std::move(text)});
}

void SystemView::on_participant(const diagnostics::ParticipantInfo& participant, Presence presence,
                                core::Nanoseconds utc_ns) {
  if (presence == Presence::kAppeared || presence == Presence::kChanged) {
    graph_.put(participant);
    if (presence == Presence::kAppeared)
      report(EventKind::kParticipantJoined, utc_ns, "", graph_.who(participant.guid),
             "joined" + (participant.host.empty() ? "" : " from " + participant.host) + ", " +
                 participant.vendor);
    return;
  }
  const auto* known = graph_.participant(participant.guid);
  if (known == nullptr) return graph_.remove(participant.guid);  // its endpoints, if any were announced
  const std::string who = graph_.who(participant.guid);
  if (presence == Presence::kLeft) {
    report(EventKind::kParticipantLeft, utc_ns, "", who, "left");
  } else {
    report(EventKind::kParticipantLost, utc_ns, "", who,
           "silent for its lease of " + duration_text(known->lease_ns) + ": killed, frozen or cut off");
  }
  graph_.remove(participant.guid);
  forget_writers([&](const Guid& guid) { return diagnostics::participant_of(guid) == participant.guid; });
  ends_changed_ = true;
}

void SystemView::on_endpoint(const EndpointInfo& endpoint, Presence presence, core::Nanoseconds utc_ns) {
  const bool here = presence == Presence::kAppeared || presence == Presence::kChanged;
  const auto* known = graph_.endpoint(endpoint.guid);
  if (!here && known == nullptr) return;
  const EndpointInfo meant = here ? endpoint : *known;
  const bool new_here = here && known == nullptr;
  if (here) {
    graph_.put(endpoint);
  } else {
    graph_.remove(endpoint.guid);
    forget_writers([&](const Guid& guid) { return guid == endpoint.guid; });
  }
  if (new_here || !here) {
    const EventKind kind = meant.writer ? (here ? EventKind::kWriterJoined : EventKind::kWriterLeft)
                                        : (here ? EventKind::kReaderJoined : EventKind::kReaderLeft);
    report(kind, utc_ns, meant.topic, graph_.who(meant.guid),
           fmt::format("{} of {}: {}", meant.writer ? "writer" : "reader", meant.type,
                       here ? diagnostics::qos_text(meant.qos) : "gone"));
  }
  ends_changed_ = true;
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
    report(EventKind::kQosMismatch, utc_ns, found.writer->topic,
           graph_.who(pair.first) + " → " + graph_.who(pair.second), std::move(text));
  }
  disagreeing_ = std::move(now);
}

template <class Predicate>
void SystemView::forget_writers(Predicate which) {
  std::erase_if(writers_, [&](const auto& item) {
    if (!which(item.first)) return false;
    told_apart_ -= item.second.instances.size();
    return true;
  });
}

/// Returns null if there is no room for another one.
ObservedWriter* SystemView::writer(const Guid& guid, const std::string& topic) {
  if (writers_.size() >= kMaxWriters && !writers_.contains(guid)) {
    // Samples may come after the end of their writer.
    forget_writers([&](const Guid& known) { return graph_.endpoint(known) == nullptr; });
    if (writers_.size() >= kMaxWriters) return nullptr;
  }
  ObservedWriter& observed = writers_[guid];
  observed.topic = topic;
  return &observed;
}

void SystemView::on_sample(const ReceivedSample& sample) {
  ObservedWriter* known = writer(sample.writer, sample.topic);
  if (known == nullptr) {
    ++left_out_;
    return;
  }
  ObservedWriter& observed = *known;
  const core::Nanoseconds utc_ns = sample.facts.received_utc_ns;
  if (sample.gone) {
    observed.stream.take_number(sample.facts.sequence_number);
    report(EventKind::kInstanceGone, utc_ns, sample.topic, graph_.who(sample.writer),
           "an instance is disposed of or has no more writers");
    return;
  }
  report_arrival(sample, observed.stream.take(sample.facts));
  const std::size_t before = observed.instances.size();
  const bool told_apart = (before < ObservedWriter::kMaxInstances && told_apart_ < kMaxInstances) ||
                          before == 0 || observed.instances.contains(sample.instance);
  ++observed.instances[told_apart ? sample.instance : ObservedWriter::kOthers];
  told_apart_ += observed.instances.size() - before;
  if (told_apart) watch_deadline(observed, sample);
  if (!sample.problem.empty()) {
    ++observed.undecodable;
    report(EventKind::kUndecodable, utc_ns, sample.topic, graph_.who(sample.writer), sample.problem);
  }
  const auto* endpoint = graph_.endpoint(sample.writer);
  if (!sample.content || endpoint == nullptr || endpoint->type != kStatusType) return;
  for (Event& event : status_.take(*sample.content)) {
    event.utc_ns = utc_ns;
    events_.add(std::move(event));
  }
}

void SystemView::report_arrival(const ReceivedSample& sample, const Arrival& arrival) {
  const core::Nanoseconds utc_ns = sample.facts.received_utc_ns;
  const std::string who = graph_.who(sample.writer);
  if (arrival.missing > 0) {
    report(EventKind::kGap, utc_ns, sample.topic, who,
           fmt::format("{} sample{} did not come before number {}", arrival.missing,
                       arrival.missing == 1 ? "" : "s", sample.facts.sequence_number));
  }
  if (arrival.skipped > 0) {
    report(EventKind::kSkip, utc_ns, sample.topic, who,
           fmt::format("the writer left out {} number{} of its stamp before {}", arrival.skipped,
                       arrival.skipped == 1 ? "" : "s", sample.facts.stamp->sequence_number));
  }
  if (arrival.restarted) {
    report(EventKind::kRestart, utc_ns, sample.topic, who,
           fmt::format("a new session of the writer's process, {:016x}", sample.facts.stamp->session));
  }
}

void SystemView::watch_deadline(ObservedWriter& observed, const ReceivedSample& sample) {
  const auto* endpoint = graph_.endpoint(sample.writer);
  if (endpoint == nullptr || endpoint->qos.deadline_ns == diagnostics::kInfinite_ns) return;
  auto& watch = observed.deadlines.try_emplace(sample.instance, endpoint->qos.deadline_ns).first->second;
  const auto made_ns = sample.facts.stamp ? sample.facts.stamp->monotonic_ns : sample.facts.source_ns;
  const auto miss = watch.take(sample.facts.received_ns, made_ns);
  if (!miss) return;
  observed.deadlines_missed += miss->periods;
  std::string text = fmt::format("{}{} between two samples{} (deadline offered: {})",
                                 miss->reported ? "samples come again, " : "", milliseconds(miss->pause_ns),
                                 instance_text(sample.instance), duration_text(watch.period_ns()));
  if (miss->made_apart_ns > 0) {
    const bool late_writer = miss->made_apart_ns > watch.period_ns();
    text += fmt::format("; they were made {} apart: {}", milliseconds(miss->made_apart_ns),
                        late_writer ? "the writer was late" : "held up on the way or in this process");
  }
  report(miss->reported ? EventKind::kDeadlineMet : EventKind::kDeadlineMissed, sample.facts.received_utc_ns,
         sample.topic, graph_.who(sample.writer), std::move(text));
}

void SystemView::on_liveliness(const Guid& guid, bool alive, core::Nanoseconds utc_ns) {
  const auto* endpoint = graph_.endpoint(guid);
  if (endpoint == nullptr) return;  // discovery has already reported its end
  ObservedWriter* known = writer(guid, endpoint->topic);
  if (known == nullptr || known->alive == alive) return;
  ObservedWriter& observed = *known;
  observed.alive = alive;
  if (alive) {
    report(EventKind::kLivelinessBack, utc_ns, endpoint->topic, graph_.who(guid),
           "the writer proves again that it lives");
    return;
  }
  ++observed.liveliness_lost;
  report(
      EventKind::kLivelinessLost, utc_ns, endpoint->topic, graph_.who(guid),
      fmt::format("no proof of life for the lease of {} ({}): the writer hangs, was killed or is cut off",
                  duration_text(endpoint->qos.lease_ns), diagnostics::to_string(endpoint->qos.liveliness)));
}

void SystemView::on_reader_made(const std::string& topic) {
  for (auto& [guid, observed] : writers_) {
    if (observed.topic != topic) continue;
    observed.stream.forget_sequence();
    observed.deadlines.clear();
  }
}

void SystemView::look(core::Nanoseconds now_ns, core::Nanoseconds utc_ns) {
  if (std::exchange(ends_changed_, false)) report_disagreements(utc_ns);
  for (auto& [guid, observed] : writers_) {
    for (auto& [instance, watch] : observed.deadlines) {
      const auto miss = watch.look(now_ns);
      if (!miss) continue;
      report(EventKind::kDeadlineMissed, utc_ns, observed.topic, graph_.who(guid),
             fmt::format("nothing{} for {} (deadline offered: {})", instance_text(instance),
                         milliseconds(miss->pause_ns), duration_text(watch.period_ns())));
    }
  }
  events_.look(utc_ns);
}

void SystemView::reset_counts() {
  for (auto& [guid, observed] : writers_) {
    observed.stream = {};
    observed.instances.clear();
    observed.deadlines.clear();
    observed.deadlines_missed = observed.undecodable = observed.liveliness_lost = 0;
  }
  told_apart_ = 0;
}

}  // namespace phantom::dds_spy
