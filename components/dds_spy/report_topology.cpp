#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "common/ros2/introspection.hpp"
#include "common/ros2/message_types.hpp"
#include "components/dds_spy/reports.hpp"
#include "components/dds_spy/table.hpp"

namespace phantom::dds_spy {
namespace {

using diagnostics::EndpointInfo;
using diagnostics::ParticipantInfo;
using Json = nlohmann::ordered_json;

struct TopicEnds {
  std::set<std::string> types;
  std::vector<const EndpointInfo*> writers, readers;
};

std::map<std::string, TopicEnds> topics_of(const ReportInput& input) {
  std::map<std::string, TopicEnds> topics;
  for (const auto& [guid, endpoint] : input.view.graph().endpoints()) {
    if (!input.topics.keeps(endpoint.topic)) continue;
    TopicEnds& ends = topics[endpoint.topic];
    ends.types.insert(endpoint.type);
    (endpoint.writer ? ends.writers : ends.readers).push_back(&endpoint);
  }
  return topics;
}

std::string names(const ReportInput& input, const std::vector<const EndpointInfo*>& endpoints) {
  std::map<std::string, int> counts;
  for (const auto* endpoint : endpoints) {
    const std::string name = input.view.graph().name(endpoint->guid);
    ++counts[name.empty() ? input.view.graph().who(endpoint->guid) : name];
  }
  std::set<std::string> texts;
  for (const auto& [name, count] : counts)
    texts.insert(count == 1 ? name : fmt::format("{} (×{})", name, count));
  return texts.empty() ? "–" : fmt::format("{}", fmt::join(texts, ", "));
}

std::set<std::string> topics_at(const ReportInput& input, const ParticipantInfo& participant, bool writer) {
  std::set<std::string> found;
  for (const auto& [guid, endpoint] : input.view.graph().endpoints()) {
    if (endpoint.writer == writer && diagnostics::participant_of(guid) == participant.guid &&
        input.topics.keeps(endpoint.topic))
      found.insert(endpoint.topic);
  }
  return found;
}

std::set<std::string> partitions_of(const ReportInput& input, const ParticipantInfo& participant) {
  std::set<std::string> found;
  for (const auto& [guid, endpoint] : input.view.graph().endpoints()) {
    if (diagnostics::participant_of(guid) == participant.guid)
      found.insert(endpoint.qos.partitions.begin(), endpoint.qos.partitions.end());
  }
  return found;
}

Json endpoint_list(const ReportInput& input, const std::vector<const EndpointInfo*>& endpoints) {
  Json list = Json::array();
  for (const auto* endpoint : endpoints) {
    list.push_back({{"guid", diagnostics::to_string(endpoint->guid)},
                    {"participant", input.view.graph().who(endpoint->guid)},
                    {"type", endpoint->type},
                    {"qos", diagnostics::qos_text(endpoint->qos)}});
    if (const auto hash = ros2::hash_in(endpoint->user_data); !hash.empty()) list.back()["type_hash"] = hash;
  }
  return list;
}

std::map<std::string, std::vector<const ParticipantInfo*>> by_host(const ReportInput& input) {
  std::map<std::string, std::vector<const ParticipantInfo*>> hosts;
  for (const auto& [guid, participant] : input.view.graph().participants())
    hosts[participant.machine].push_back(&participant);
  for (auto& [machine, list] : hosts) {
    std::sort(list.begin(), list.end(), [](const auto* a, const auto* b) {
      return std::tie(a->name, a->guid) < std::tie(b->name, b->guid);
    });
  }
  return hosts;
}

std::vector<std::string> node_names(const ReportInput& input, const ParticipantInfo& participant) {
  std::vector<std::string> all;
  for (const auto& node : input.view.graph().nodes(participant.guid)) all.push_back(node.name);
  return all;
}

// "sensor_msgs/msg/JointState (ROS 2)"; with what is wrong about the hashes of the ends.
std::string type_text(const ReportInput& input, const std::string& type, const TopicEnds& ends) {
  if (is_project_type(input, type)) return type;
  const std::string in_ros = ros2::ros_type(type);
  if (in_ros.empty()) return type + " (foreign)";
  std::set<std::string> hashes;
  for (const auto* list : {&ends.writers, &ends.readers})
    for (const auto* endpoint : *list)
      if (const auto hash = ros2::hash_in(endpoint->user_data); !hash.empty()) hashes.insert(hash);
  if (const auto* known = ros2::find_message_type(type); known != nullptr && !hashes.empty())
    hashes.insert(known->hash);
  return in_ros + (hashes.size() > 1 ? " (ROS 2, hashes of the type differ)" : " (ROS 2)");
}

std::string counted(std::size_t count, const char* what) {
  return fmt::format("{} {}{}", count, what, count == 1 ? "" : "s");
}

}  // namespace

bool is_project_type(const ReportInput& input, const std::string& type) {
  return std::any_of(input.contracts.begin(), input.contracts.end(),
                     [&](const auto& contract) { return contract.second.type == type; });
}

Json topology_json(const ReportInput& input) {
  const auto& graph = input.view.graph();
  Json participants = Json::array(), topics = Json::array();
  for (const auto& [guid, participant] : graph.participants()) {
    Json entry{{"guid", diagnostics::to_string(guid)},
               {"name", participant.name},
               {"host", participant.host},
               {"process", participant.process},
               {"user", participant.user},
               {"vendor", participant.vendor},
               {"lease", diagnostics::duration_text(participant.lease_ns)},
               {"locators", participant.locators},
               {"partitions", partitions_of(input, participant)}};
    if (const auto nodes = node_names(input, participant); !nodes.empty()) entry["nodes"] = nodes;
    entry["writes"] = topics_at(input, participant, true);
    entry["reads"] = topics_at(input, participant, false);
    participants.push_back(std::move(entry));
  }
  for (const auto& [name, ends] : topics_of(input)) {
    const auto& first = ends.writers.empty() ? *ends.readers.front() : *ends.writers.front();
    topics.push_back({{"name", name},
                      {"types", ends.types},
                      {"foreign", !is_project_type(input, first.type)},
                      {"keyed", first.keyed},
                      {"writers", endpoint_list(input, ends.writers)},
                      {"readers", endpoint_list(input, ends.readers)}});
    if (const auto topic = ros2::ros_topic(name); !topic.empty())
      topics.back()["ros2"] = {{"topic", topic}, {"type", ros2::ros_type(first.type)}};
  }
  return {{"domain", input.domain},
          {"seconds", input.seconds},
          {"participants", std::move(participants)},
          {"topics", std::move(topics)},
          {"mismatches", graph.disagreements().size()}};
}

std::string topology_text(const ReportInput& input) {
  const auto& graph = input.view.graph();
  const auto hosts = by_host(input);
  const auto topics = topics_of(input);
  const auto writers = std::count_if(graph.endpoints().begin(), graph.endpoints().end(),
                                     [](const auto& e) { return e.second.writer; });
  std::string text =
      fmt::format("domain {}: {} on {}, {}, {}, {}\n", input.domain,
                  counted(graph.participants().size(), "participant"), counted(hosts.size(), "host"),
                  counted(topics.size(), "topic"), counted(static_cast<std::size_t>(writers), "writer"),
                  counted(graph.endpoints().size() - static_cast<std::size_t>(writers), "reader"));
  for (const auto& [machine, participants] : hosts) {
    text += fmt::format("\nhost {}\n",
                        participants.front()->host.empty() ? "unknown" : participants.front()->host);
    for (const auto* participant : participants) {
      std::set<std::string> locators(participant->locators.begin(), participant->locators.end());
      text +=
          fmt::format("  {:<18} {}{}, {}, {}\n", participant->name.empty() ? "(no name)" : participant->name,
                      participant->process.empty() ? "process unknown" : "process " + participant->process,
                      participant->user.empty() ? "" : " of " + participant->user, participant->vendor,
                      fmt::join(locators, " "));
      if (const auto partitions = partitions_of(input, *participant); !partitions.empty())
        text += fmt::format("    in partition {}\n", fmt::join(partitions, ", "));
      if (const auto nodes = node_names(input, *participant); !nodes.empty())
        text += fmt::format("    nodes {}\n", fmt::join(nodes, ", "));
      for (const bool writer : {true, false}) {
        const auto names_there = topics_at(input, *participant, writer);
        if (!names_there.empty())
          text += fmt::format("    {} {}\n", writer ? "writes" : "reads ", fmt::join(names_there, ", "));
      }
    }
  }
  Table table({"TOPIC", "TYPE", "WRITERS", "READERS"});
  for (const auto& [name, ends] : topics) {
    std::vector<std::string> types;
    for (const std::string& type : ends.types) types.push_back(type_text(input, type, ends));
    table.add({name, fmt::format("{}", fmt::join(types, " | ")), names(input, ends.writers),
               names(input, ends.readers)});
  }
  if (!table.empty()) text.append("\n").append(table.text());
  const auto mismatched = graph.disagreements().size();
  if (mismatched > 0) {
    text += fmt::format("\n{} of writers and readers do not communicate: dds_spy qos says why.\n",
                        mismatched == 1 ? "1 pair" : fmt::format("{} pairs", mismatched));
  }
  return text;
}

}  // namespace phantom::dds_spy
