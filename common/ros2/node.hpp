#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/dds/endpoints/endpoint.hpp"

namespace phantom::ros2 {

/// Form of the graph message (topic ros_discovery_info) that a ROS 2 distribution reads: Humble and before
/// have identifiers of 24 octets, Iron and later of 16. The wrong form ends nodes of the other distributions,
/// so none is sent until one is chosen; without it a topic's node is shown as unknown.
enum class Graph { kNone, kHumble, kSinceIron };

/// How a node joins a ROS 2 domain.
struct NodeOptions {
  std::string name = "phantom";            ///< of the node, in the namespace "/"
  int domain = 0;                          ///< ROS_DOMAIN_ID
  std::vector<std::string> interfaces;     ///< IP addresses of this host to use; empty: all
  std::vector<std::string> initial_peers;  ///< addresses of hosts to announce to; empty: by multicast
  Graph graph = Graph::kNone;
};

/// QoS presets of ROS 2 (rmw/qos_profiles.h).
inline constexpr dds::QosContract kDefault{.history_depth = 10};
inline constexpr dds::QosContract kTransforms{.history_depth = 100};
inline constexpr dds::QosContract kLatched{.durability = dds::Durability::kTransientLocal,
                                           .history_depth = 1};

/// A node of ROS 2: one participant of a ROS 2 domain, of which ROS 2 tools see the name, topics and types.
/// Endpoints keep it alive. Thread-safe.
class Node {
 public:
  /// Throws dds::DdsError, and MissingError if an interface is missing.
  explicit Node(const NodeOptions& options);
  ~Node();

  dds::Participant& participant() { return participant_; }
  /// Add an endpoint to the graph.
  void add_writer(const dds::Guid& guid);
  void add_reader(const dds::Guid& guid);

 private:
  struct GraphWriter;
  void add(std::vector<dds::Guid>& endpoints, const dds::Guid& guid);

  std::string name_;
  dds::Participant participant_;
  std::mutex mutex_;
  std::vector<dds::Guid> writers_, readers_;
  std::unique_ptr<GraphWriter> graph_;  // null: no graph is sent
};

}  // namespace phantom::ros2
