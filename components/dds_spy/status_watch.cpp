#include "components/dds_spy/status_watch.hpp"

#include <spdlog/fmt/fmt.h>

#include <nlohmann/json.hpp>

namespace phantom::dds_spy {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kCounters[] = {"deadline_missed", "liveliness_lost", "incompatible_qos", "refused"};

}  // namespace

std::vector<Event> StatusWatch::take(const Json& status) {
  std::vector<Event> events;
  try {
    const auto name = status.at("component_name").get<std::string>();
    const auto who = name + " on " + status.at("host").get<std::string>();
    const auto state = status.at("state").get<std::string>(),
               message = status.at("message").get<std::string>();
    auto& last = states_[who];
    if (last != state) {
      std::string text = last.empty() ? state : last + " → " + state;
      if (!message.empty()) text += ", \"" + message + "\"";
      events.push_back(
          {.kind = EventKind::kComponentState, .topic = "", .who = who, .text = std::move(text)});
      last = state;
    }
    for (const Json& endpoint : status.at("topics")) {
      const auto topic = endpoint.at("topic").get<std::string>();
      const bool writer = endpoint.at("writer").get<bool>();
      for (const char* counter : kCounters) {
        const auto value = endpoint.at(counter).get<std::uint64_t>();
        const auto [place, first] = counters_.try_emplace({who, topic, writer, counter}, value);
        if (!first && value > place->second) {
          events.push_back({.kind = EventKind::kComponentCounter,
                            .topic = topic,
                            .who = who,
                            .text = fmt::format("its {}'s {} rose by {} to {}", writer ? "writer" : "reader",
                                                counter, value - place->second, value)});
        }
        place->second = value;
      }
    }
  } catch (const Json::exception&) {
    events.clear();  // another type by this name: not watched, but listed as undecodable or foreign
  }
  return events;
}

}  // namespace phantom::dds_spy
