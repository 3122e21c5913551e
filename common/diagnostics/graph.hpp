#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/diagnostics/qos.hpp"

namespace phantom::diagnostics {

/// RTPS GUID: 12 octets of the participant's prefix, 4 of the entity.
using Guid = std::array<std::uint8_t, 16>;

/// "01.0f.3a.…|00.00.01.03"
std::string to_string(const Guid& guid);
/// Returns the participant that an endpoint belongs to: the same prefix, entity 00.00.01.c1.
Guid participant_of(const Guid& endpoint);
/// Returns whether the two prefixes were made on one host. Valid for Fast DDS and vendors that do the same:
/// the first four octets are vendor and host.
bool same_host(const Guid& a, const Guid& b);

/// A member of the DDS domain, as it announces itself.
struct ParticipantInfo {
  Guid guid{};
  std::string name;  ///< in this project, the component's name
  std::string host;  ///< announced name of the host, or its address; empty: unknown
  /// Distinguishes hosts of the same name; the host's name if nothing better is announced.
  std::string machine;
  std::string user;     ///< empty: not announced
  std::string process;  ///< process id; empty: not announced
  std::string vendor;
  std::vector<std::string> locators;  ///< where it listens: "UDPv4 127.0.0.1:7411"
  std::int64_t lease_ns = kInfinite_ns;
};

/// How discovery reports a participant or an endpoint.
enum class Presence {
  kAppeared,
  kChanged,
  kLeft,  ///< it announced its end itself
  kLost   ///< participants only: not heard for its lease
};

/// A writer or reader of a participant.
struct EndpointInfo {
  Guid guid{};
  bool writer = false;
  std::string topic;
  std::string type;
  bool keyed = false;
  EndpointQos qos;
  std::string user_data;  ///< octets that its owner adds: ROS 2 puts the type's hash there
};

/// A node of ROS 2, as its participant names it: with namespace, and its readers and writers.
struct NodeInfo {
  std::string name;
  std::vector<Guid> endpoints;
};

/// Returns why a writer and a reader of one topic do not communicate: QoS, or different types of the topic.
std::vector<Mismatch> mismatches(const EndpointInfo& writer, const EndpointInfo& reader);

struct Disagreement {
  const EndpointInfo* writer = nullptr;
  const EndpointInfo* reader = nullptr;
  std::vector<Mismatch> reasons;
};

/// All participants and endpoints that were discovered and are still present. Not thread-safe.
class Graph {
 public:
  static constexpr std::size_t kMaxPairs = 1 << 18, kMaxDisagreements = 1024, kMaxNodes = 256;

  void put(const ParticipantInfo& participant) { participants_[participant.guid] = participant; }
  void put(const EndpointInfo& endpoint) { endpoints_[endpoint.guid] = endpoint; }
  /// Replaces the nodes of a participant that was put, kMaxNodes at most; does nothing for another.
  void put_nodes(const Guid& participant, std::vector<NodeInfo> nodes);
  /// Removes a participant with its endpoints, also if it was never put, or an endpoint.
  void remove(const Guid& guid);

  const std::map<Guid, ParticipantInfo>& participants() const { return participants_; }
  const std::map<Guid, EndpointInfo>& endpoints() const { return endpoints_; }
  /// Returns the participant of a participant's or an endpoint's GUID; null: not announced.
  const ParticipantInfo* participant(const Guid& of) const;
  const EndpointInfo* endpoint(const Guid& guid) const;
  /// Returns a participant's nodes; empty: it names none.
  const std::vector<NodeInfo>& nodes(const Guid& of) const;
  /// Returns the node that an endpoint belongs to, or the participant's name.
  std::string name(const Guid& of) const;
  /// Returns "slave_io (process 4711)", "slave_io on 10.0.0.2" if no process is announced, or the GUID.
  std::string who(const Guid& guid) const;
  /// Returns every pair of a writer and a reader of one topic that do not communicate. A pair whose only
  /// difference is the partition is included only if one of the two meets nobody in its own partition: cells
  /// that share a domain are separate on purpose, a mistyped name is not. Looks at kMaxPairs pairs and
  /// returns kMaxDisagreements of those, because both numbers grow with the square of the endpoints. Valid
  /// until the next change.
  std::vector<Disagreement> disagreements() const;

 private:
  std::map<Guid, ParticipantInfo> participants_;
  std::map<Guid, EndpointInfo> endpoints_;
  std::map<Guid, std::vector<NodeInfo>> nodes_;  // by participant
};

}  // namespace phantom::diagnostics
