#include "components/dds_spy/status_watch.hpp"

#include <spdlog/fmt/fmt.h>

namespace phantom::dds_spy {
namespace {

using Json = nlohmann::ordered_json;

struct Counter {
  const char* member;
  const char* text;
};
constexpr Counter kCounters[] = {{"deadline_missed", "deadlines missed"},
                                 {"liveliness_lost", "losses of liveliness"},
                                 {"incompatible_qos", "endpoints refused for their QoS"},
                                 {"refused", "samples refused as stale, out of order or invalid"}};

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
      for (const Counter& counter : kCounters) {
        const auto value = endpoint.at(counter.member).get<std::uint64_t>();
        const auto [place, first] = counters_.try_emplace({who, topic, writer, counter.member}, value);
        if (!first && value > place->second) {
          events.push_back(
              {.kind = EventKind::kComponentCounter,
               .topic = topic,
               .who = who,
               .text = fmt::format("its {} counts {} {} ({} in all)", writer ? "writer" : "reader",
                                   value - place->second, counter.text, value)});
        }
        place->second = value;
      }
    }
  } catch (const Json::exception&) {
    events.clear();  // another type under this name: listed as undecodable or foreign, not watched
  }
  return events;
}

}  // namespace phantom::dds_spy
