#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "components/dds_spy/reports.hpp"

namespace phantom::dds_spy {
namespace {

using diagnostics::Disagreement;
using diagnostics::EndpointInfo;
using Json = nlohmann::ordered_json;

/// Returns the endpoint's departures from the topic's contract: "deadline none (contract: 20 ms)".
std::vector<std::string> departures(const ReportInput& input, const EndpointInfo& endpoint) {
  std::vector<std::string> found;
  const auto contract = input.contracts.find(endpoint.topic);
  if (contract == input.contracts.end()) return found;
  const auto compare = [&](const char* policy, const std::string& actual, const std::string& required) {
    if (actual != required) found.push_back(fmt::format("{} {} (contract: {})", policy, actual, required));
  };
  const auto &actual = endpoint.qos, &required = contract->second.qos;
  compare("type", endpoint.type, contract->second.type);
  compare("reliability", diagnostics::to_string(actual.reliability),
          diagnostics::to_string(required.reliability));
  compare("durability", diagnostics::to_string(actual.durability),
          diagnostics::to_string(required.durability));
  compare("deadline", diagnostics::duration_text(actual.deadline_ns),
          diagnostics::duration_text(required.deadline_ns));
  compare("liveliness", diagnostics::to_string(actual.liveliness),
          diagnostics::to_string(required.liveliness));
  compare("liveliness lease", diagnostics::duration_text(actual.lease_ns),
          diagnostics::duration_text(required.lease_ns));
  if (endpoint.writer)
    compare("lifespan", diagnostics::duration_text(actual.lifespan_ns),
            diagnostics::duration_text(required.lifespan_ns));
  return found;
}

std::vector<const EndpointInfo*> endpoints_of(const ReportInput& input) {
  std::vector<const EndpointInfo*> list;
  for (const auto& [guid, endpoint] : input.view.graph().endpoints()) {
    if (input.topics.keeps(endpoint.topic)) list.push_back(&endpoint);
  }
  std::sort(list.begin(), list.end(), [](const auto* a, const auto* b) {
    return std::make_tuple(a->topic, !a->writer, a->guid) < std::make_tuple(b->topic, !b->writer, b->guid);
  });
  return list;
}

std::vector<Disagreement> disagreements_of(const ReportInput& input) {
  auto list = input.view.graph().disagreements();
  std::erase_if(list, [&](const Disagreement& d) { return !input.topics.keeps(d.writer->topic); });
  return list;
}

}  // namespace

Json qos_json(const ReportInput& input) {
  const auto& graph = input.view.graph();
  Json endpoints = Json::array(), mismatches = Json::array();
  for (const auto* endpoint : endpoints_of(input)) {
    const auto& qos = endpoint->qos;
    endpoints.push_back({{"topic", endpoint->topic},
                         {"end", endpoint->writer ? "writer" : "reader"},
                         {"participant", graph.who(endpoint->guid)},
                         {"guid", diagnostics::to_string(endpoint->guid)},
                         {"type", endpoint->type},
                         {"reliability", diagnostics::to_string(qos.reliability)},
                         {"durability", diagnostics::to_string(qos.durability)},
                         {"deadline", diagnostics::duration_text(qos.deadline_ns)},
                         {"liveliness", diagnostics::to_string(qos.liveliness)},
                         {"lease", diagnostics::duration_text(qos.lease_ns)},
                         {"lifespan", diagnostics::duration_text(qos.lifespan_ns)},
                         {"ownership", diagnostics::to_string(qos.ownership)},
                         {"partitions", qos.partitions},
                         {"departs_from_contract", departures(input, *endpoint)}});
  }
  for (const auto& found : disagreements_of(input)) {
    Json reasons = Json::array();
    for (const auto& reason : found.reasons) {
      reasons.push_back({{"policy", reason.policy},
                         {"offered", reason.offered},
                         {"requested", reason.requested},
                         {"rule", reason.rule},
                         {"advice", reason.advice}});
    }
    mismatches.push_back({{"topic", found.writer->topic},
                          {"writer", graph.who(found.writer->guid)},
                          {"reader", graph.who(found.reader->guid)},
                          {"reasons", std::move(reasons)}});
  }
  return {
      {"domain", input.domain}, {"mismatches", std::move(mismatches)}, {"endpoints", std::move(endpoints)}};
}

std::string qos_text(const ReportInput& input) {
  const auto& graph = input.view.graph();
  std::string text, topic;
  for (const auto* endpoint : endpoints_of(input)) {
    if (endpoint->topic != topic) text += (topic.empty() ? "" : "\n") + endpoint->topic + "\n";
    topic = endpoint->topic;
    text += fmt::format("  {} {:<32} {}\n", endpoint->writer ? "writer" : "reader", graph.who(endpoint->guid),
                        diagnostics::qos_text(endpoint->qos));
    for (const auto& departure : departures(input, *endpoint))
      text += "         departs from the contract: " + departure + "\n";
  }
  const auto found = disagreements_of(input);
  if (found.empty())
    return text + (text.empty() ? "" : "\n") + "Every writer and reader of a topic fit together.\n";
  text += fmt::format("\n{} not communicate:\n",
                      found.size() == 1 ? "1 pair does" : fmt::format("{} pairs do", found.size()));
  for (const auto& pair : found) {
    text += fmt::format("  {}: {} → {}\n", pair.writer->topic, graph.who(pair.writer->guid),
                        graph.who(pair.reader->guid));
    for (const auto& reason : pair.reasons) {
      text += fmt::format("    {}: offered {}, requested {}\n      {}.\n      What to do: {}.\n",
                          reason.policy, reason.offered, reason.requested, reason.rule, reason.advice);
    }
  }
  return text;
}

}  // namespace phantom::dds_spy
