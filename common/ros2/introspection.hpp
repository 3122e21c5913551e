#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/diagnostics/graph.hpp"
#include "common/diagnostics/type.hpp"

// What tools need to show a ROS 2 domain in ROS 2's words. Pure, and bounded by what it is given: strangers
// write it.

namespace phantom::ros2 {

/// Topic of DDS on which the participants of a ROS 2 domain name their nodes.
inline constexpr const char* kGraphTopic = "ros_discovery_info";

/// Returns the description of a message type that this program knows, by its name in DDS; null for any
/// other. Thread-safe.
diagnostics::TypePtr type_tree(const std::string& dds_type);

/// Returns the topic's name in ROS 2: "/joint_states" of "rt/joint_states"; empty for any other topic.
std::string ros_topic(const std::string& dds_topic);
/// Returns the type's name in ROS 2: "pkg/msg/Name" of "pkg::msg::dds_::Name_"; empty for any other type.
std::string ros_type(const std::string& dds_type);
/// Returns the hash in an endpoint's USER_DATA, "RIHS01_…"; empty: it has none.
std::string hash_in(const std::string& user_data);

/// A message of kGraphTopic.
struct ParticipantNodes {
  diagnostics::Guid participant{};
  std::vector<diagnostics::NodeInfo> nodes;
  diagnostics::TypePtr form;  ///< the one that fits: of Humble and before, or of Iron and later
};
/// Reads a message with its encapsulation header, in either form; none: it has neither.
std::optional<ParticipantNodes> read_graph(std::span<const std::uint8_t> bytes);

}  // namespace phantom::ros2
