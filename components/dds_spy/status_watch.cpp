#include "components/dds_spy/status_watch.hpp"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>
#include <string_view>

namespace phantom::dds_spy {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kCounters[] = {"deadline_missed", "liveliness_lost", "incompatible_qos", "refused"};

constexpr std::string_view kRefused = "refused: ", kRefusedFrom = "refused from: ";

/// Returns ", 7 of them from 10.30.1.2", or nothing if the component does not tell it.
std::string greatest_sender(const Json& status, const std::string& reason) {
  for (const Json& figure : status.at("figures")) {
    if (figure.at("name").get<std::string>() != std::string(kRefusedFrom) + reason) continue;
    if (!figure.at("value").is_number()) return "";
    return fmt::format(", {:.0f} of them from {}", figure.at("value").get<double>(),
                       figure.at("unit").get<std::string>());
  }
  return "";
}

}  // namespace

std::vector<Event> StatusWatch::take(const Json& status) {
  std::vector<Event> events;
  try {
    const auto name = status.at("component_name").get<std::string>();
    const auto who = name + " on " + status.at("host").get<std::string>();
    const auto state = status.at("state").get<std::string>(),
               message = status.at("message").get<std::string>();
    Known& known = known_.find_or_add(who).first;
    std::string& last = known.state;
    const bool first_look = last.empty();
    if (last != state) {
      std::string text = last.empty() ? state : last + " → " + state;
      if (!message.empty()) text += ", \"" + message + "\"";
      events.push_back(
          {.kind = EventKind::kComponentState, .topic = "", .who = who, .text = std::move(text)});
      last = state;
    }
    Counters counters;  // of this sample's topics only
    for (const Json& endpoint : status.at("topics")) {
      const auto topic = endpoint.at("topic").get<std::string>();
      const bool writer = endpoint.at("writer").get<bool>();
      for (const char* counter : kCounters) {
        const auto value = endpoint.at(counter).get<std::uint64_t>();
        const auto before = known.counters.find({topic, writer, counter});
        if (before != known.counters.end() && value > before->second) {
          events.push_back({.kind = EventKind::kComponentCounter,
                            .topic = topic,
                            .who = who,
                            .text = fmt::format("its {}'s {} rose by {} to {}", writer ? "writer" : "reader",
                                                counter, value - before->second, value)});
        }
        counters[{topic, writer, counter}] = value;
      }
    }
    add_refused_datagrams(who, status, known, first_look, counters, events);
    known.counters = std::move(counters);
  } catch (const Json::exception&) {
    events.clear();  // another type by this name: not watched, but listed as undecodable or foreign
  }
  return events;
}

/// What the component's guard refused of what was sent to it: StatusReporter's figures "refused: REASON" and
/// "refused from: REASON".
void StatusWatch::add_refused_datagrams(const std::string& who, const Json& status, const Known& known,
                                        bool first_look, Counters& counters, std::vector<Event>& events) {
  for (const Json& figure : status.at("figures")) {
    const auto name = figure.at("name").get<std::string>();
    if (!name.starts_with(kRefused) || !figure.at("value").is_number()) continue;
    const auto value = static_cast<std::uint64_t>(figure.at("value").get<double>());
    const std::string reason = name.substr(kRefused.size());
    const auto before = known.counters.find({"", false, name});
    // A reason that was not there at the last look is news, too.
    const std::uint64_t last = before != known.counters.end() ? before->second : first_look ? value : 0;
    if (value > last) {
      events.push_back({.kind = EventKind::kComponentCounter,
                        .topic = "",
                        .who = who,
                        .text = fmt::format("it refused {} datagrams: {} ({} so far{})", value - last, reason,
                                            value, greatest_sender(status, reason))});
    }
    counters[{"", false, name}] = value;
  }
}

}  // namespace phantom::dds_spy
