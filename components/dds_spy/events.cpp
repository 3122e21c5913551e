#include "components/dds_spy/events.hpp"

#include <spdlog/fmt/chrono.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <ctime>
#include <nlohmann/json.hpp>

namespace phantom::dds_spy {
namespace {

struct Kind {
  const char* name;
  bool bursts = false;  // can come at a topic's rate
};
constexpr Kind kKinds[] = {  // in the order of EventKind
    {"participant_joined"},
    {"participant_left"},
    {"participant_lost"},
    {"writer_joined"},
    {"writer_left"},
    {"reader_joined"},
    {"reader_left"},
    {"qos_mismatch"},
    {"gap", true},
    {"skip", true},
    {"restart"},
    {"deadline_missed", true},
    {"deadline_met", true},
    {"liveliness_lost", true},
    {"liveliness_back", true},
    {"undecodable", true},
    {"instance_gone", true},
    {"component_state"},
    {"component_counter"}};

const Kind& kind_of(EventKind kind) { return kKinds[static_cast<std::size_t>(kind)]; }

std::string clock_text(core::Nanoseconds utc_ns) {
  const std::time_t seconds = utc_ns / core::kNsPerSecond;
  std::tm local{};
  localtime_r(&seconds, &local);
  return fmt::format("{:%H:%M:%S}.{:03}", local, utc_ns % core::kNsPerSecond / core::kNsPerMillisecond);
}

}  // namespace

const char* name_of(EventKind kind) { return kind_of(kind).name; }

std::vector<std::string> event_kind_names() {
  std::vector<std::string> names;
  for (const Kind& kind : kKinds) names.emplace_back(kind.name);
  return names;
}

std::string event_line(const Event& event) {
  std::string line = fmt::format("{}  {:<18}  ", clock_text(event.utc_ns), name_of(event.kind));
  if (!event.topic.empty()) line += event.topic + "  ";
  line += event.who + ": " + event.text;
  if (event.count > 1) line += fmt::format("  [{} times since the last line]", event.count);
  return line;
}

nlohmann::ordered_json event_json(const Event& event) {
  return {{"utc_ns", event.utc_ns}, {"event", name_of(event.kind)}, {"topic", event.topic},
          {"who", event.who},       {"text", event.text},           {"count", event.count}};
}

EventLog::EventLog(std::size_t most, double quiet_s, Report report)
    : most_(most), quiet_ns_(core::from_seconds(quiet_s)), report_(std::move(report)) {}

void EventLog::add(Event event) {
  totals_[event.kind] += event.count;
  if (!kind_of(event.kind).bursts) return report(event);
  const Key key{event.kind, event.topic, event.who};
  if (held_.size() >= kMaxHeld && !held_.contains(key)) make_room();
  Held& held = held_[key];
  if (held.reported_ns != 0 && event.utc_ns - held.reported_ns < quiet_ns_) {
    held.count += event.count;
    held.event = std::move(event);
    return;
  }
  release(held);
  held.reported_ns = event.utc_ns;
  report(event);
}

void EventLog::look(core::Nanoseconds utc_ns) {
  for (auto item = held_.begin(); item != held_.end();) {
    Held& held = item->second;
    if (utc_ns - held.reported_ns < quiet_ns_) {
      ++item;
    } else if (held.count > 0) {
      release(held);
      held.reported_ns = utc_ns;
      ++item;
    } else {
      item = held_.erase(item);
    }
  }
}

void EventLog::flush() {
  for (auto& [key, held] : held_) release(held);
}

void EventLog::make_room() {
  const auto longest = std::min_element(held_.begin(), held_.end(), [](const auto& a, const auto& b) {
    return a.second.reported_ns < b.second.reported_ns;
  });
  release(longest->second);
  held_.erase(longest);
}

void EventLog::release(Held& held) {
  if (held.count == 0) return;
  held.event.count = held.count;
  held.count = 0;
  report(held.event);
}

void EventLog::report(const Event& event) {
  newest_.push_back(event);
  if (newest_.size() > most_) newest_.pop_front();
  if (report_) report_(event);
}

}  // namespace phantom::dds_spy
