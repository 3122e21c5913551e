#pragma once

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "tests/ros2/foreign_node.hpp"

namespace phantom::ros2::test {

/// What `ros2 topic info -v` prints of an endpoint.
struct ShownEndpoint {
  std::string node, node_namespace, type, hash;
  bool publishes = false;
};

/// The tools `ros2 node list`, `ros2 topic list -t` and `ros2 topic info -v`, by what a node of that
/// distribution hears: a literal twin of rmw_dds_common's GraphCache and rmw_fastrtps' names.
class GraphTools {
 public:
  explicit GraphTools(ForeignNode& node) : node_(node) {}

  /// Nodes of participants that have an enclave, "/phantom".
  std::vector<std::string> node_list() {
    std::vector<std::string> all;
    const auto graph = node_.graph();
    const auto users = node_.participants();
    const bool enclave = std::any_of(users.begin(), users.end(),
                                     [](const auto& data) { return data.starts_with("enclave=/"); });
    if (graph && enclave && !graph->node.empty())
      all.push_back(graph->node_namespace + (graph->node_namespace == "/" ? "" : "/") + graph->node);
    return all;
  }

  /// Types by topic, for topics of ROS 2 alone.
  std::map<std::string, std::set<std::string>> topic_list() {
    std::map<std::string, std::set<std::string>> all;
    for (const auto& [topic, endpoint] : node_.endpoints())
      if (topic.starts_with("rt/")) all[topic.substr(2)].insert(demangled(endpoint.type));
    return all;
  }

  std::vector<ShownEndpoint> topic_info(const std::string& topic) {
    std::vector<ShownEndpoint> all;
    for (const auto& [name, endpoint] : node_.endpoints()) {
      if (name != "rt" + topic) continue;
      ShownEndpoint shown{.node = "_CREATED_BY_BARE_DDS_APP_",
                          .node_namespace = "_CREATED_BY_BARE_DDS_APP_",
                          .type = demangled(endpoint.type),
                          .hash = hash(endpoint.user_data),
                          .publishes = (endpoint.guid[15] & 0x3e) == 0x02};  // RTPS 2.5, table 9.1
      if (const auto graph = node_.graph()) {
        const auto& list = shown.publishes ? graph->writers : graph->readers;
        if (std::find(list.begin(), list.end(), endpoint.guid) != list.end())
          shown.node = graph->node, shown.node_namespace = graph->node_namespace;
      }
      all.push_back(shown);
    }
    return all;
  }

 private:
  // _demangle_if_ros_type
  static std::string demangled(const std::string& dds_type) {
    const std::string middle = "dds_::";
    const auto at = dds_type.find(middle);
    if (dds_type.empty() || dds_type.back() != '_' || at == std::string::npos) return dds_type;
    std::string spaces = dds_type.substr(0, at), shown;
    for (auto colons = spaces.find("::"); colons != std::string::npos; colons = spaces.find("::"))
      spaces.replace(colons, 2, "/");
    const auto begin = at + middle.size();
    return spaces + dds_type.substr(begin, dds_type.size() - begin - 1);
  }
  // parse_type_hash_from_user_data
  static std::string hash(const std::string& user_data) {
    const auto begin = user_data.find("typehash="), end = user_data.find(';', begin);
    if (begin == std::string::npos || end == std::string::npos) return "INVALID";
    const std::string value = user_data.substr(begin + 9, end - begin - 9);
    const bool whole = value.size() == 71 && value.starts_with("RIHS01_") &&
                       value.find_first_not_of("0123456789abcdef", 7) == std::string::npos;
    return whole ? value : "INVALID";
  }

  ForeignNode& node_;
};

}  // namespace phantom::ros2::test
