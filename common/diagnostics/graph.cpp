#include "common/diagnostics/graph.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>

namespace phantom::diagnostics {
namespace {

constexpr std::size_t kPrefix = 12, kHostPart = 4;

bool same_prefix(const Guid& a, const Guid& b) {
  return std::equal(a.begin(), a.begin() + kPrefix, b.begin());
}

using Ends = std::vector<const EndpointInfo*>;

bool apart_by_partition_alone(const std::vector<Mismatch>& reasons) {
  return reasons.size() == 1 && reasons.front().policy == "partition";
}

/// Which ends of a topic meet one of the other side in a partition. Each is looked for once.
class Meetings {
 public:
  explicit Meetings(const Ends& others) : others_(others) {}
  bool has(const EndpointInfo& end) {
    const auto [known, fresh] = known_.try_emplace(&end);
    if (fresh) {
      known->second = std::any_of(others_.begin(), others_.end(), [&](const EndpointInfo* other) {
        return share_a_partition(end.qos.partitions, other->qos.partitions);
      });
    }
    return known->second;
  }

 private:
  const Ends& others_;
  std::map<const EndpointInfo*, bool> known_;
};

}  // namespace

std::string to_string(const Guid& guid) {
  std::string text;
  for (std::size_t i = 0; i < guid.size(); ++i)
    text += fmt::format("{}{:02x}", i == 0 ? "" : i == kPrefix ? "|" : ".", guid[i]);
  return text;
}

Guid participant_of(const Guid& endpoint) {
  Guid guid = endpoint;
  guid[12] = guid[13] = 0;
  guid[14] = 1;
  guid[15] = 0xc1;
  return guid;
}

bool same_host(const Guid& a, const Guid& b) {
  return std::equal(a.begin(), a.begin() + kHostPart, b.begin());
}

std::vector<Mismatch> mismatches(const EndpointInfo& writer, const EndpointInfo& reader) {
  std::vector<Mismatch> found;
  if (writer.type != reader.type) {
    found.push_back({"type", writer.type, reader.type,
                     "one topic has one type: samples of another cannot be read",
                     "use another topic's name for one of them, or the same IDL at both ends"});
  }
  if (writer.keyed != reader.keyed) {
    const auto text = [](bool keyed) { return std::string(keyed ? "with key" : "without key"); };
    found.push_back({"key", text(writer.keyed), text(reader.keyed),
                     "both ends must agree whether the type has a key",
                     "use the same IDL, with the same @key, at both ends"});
  }
  for (auto& reason : mismatches(writer.qos, reader.qos)) found.push_back(std::move(reason));
  return found;
}

void Graph::remove(const Guid& guid) {
  if (guid == participant_of(guid)) {
    participants_.erase(guid);
    nodes_.erase(guid);
    std::erase_if(endpoints_, [&](const auto& item) { return same_prefix(item.first, guid); });
  } else {
    endpoints_.erase(guid);
  }
}

const ParticipantInfo* Graph::participant(const Guid& of) const {
  const auto found = participants_.find(participant_of(of));
  return found == participants_.end() ? nullptr : &found->second;
}

const EndpointInfo* Graph::endpoint(const Guid& guid) const {
  const auto found = endpoints_.find(guid);
  return found == endpoints_.end() ? nullptr : &found->second;
}

void Graph::put_nodes(const Guid& participant, std::vector<NodeInfo> nodes) {
  if (!participants_.contains(participant)) return;
  if (nodes.size() > kMaxNodes) nodes.resize(kMaxNodes);
  nodes_[participant] = std::move(nodes);
}

const std::vector<NodeInfo>& Graph::nodes(const Guid& of) const {
  static const std::vector<NodeInfo> none;
  const auto found = nodes_.find(participant_of(of));
  return found == nodes_.end() ? none : found->second;
}

std::string Graph::name(const Guid& of) const {
  for (const NodeInfo& node : nodes(of))
    if (std::find(node.endpoints.begin(), node.endpoints.end(), of) != node.endpoints.end()) return node.name;
  const ParticipantInfo* found = participant(of);
  return found == nullptr ? "" : found->name;
}

std::string Graph::who(const Guid& guid) const {
  const ParticipantInfo* found = participant(guid);
  if (found == nullptr) return to_string(participant_of(guid));
  const std::string known = name(guid), shown = known.empty() ? "a participant without a name" : known;
  if (!found->process.empty()) return shown + " (process " + found->process + ")";
  return found->host.empty() ? shown : shown + " on " + found->host;
}

std::vector<Disagreement> Graph::disagreements() const {
  std::map<std::string, std::pair<Ends, Ends>> by_topic;
  for (const auto& [guid, endpoint] : endpoints_) {
    auto& ends = by_topic[endpoint.topic];
    (endpoint.writer ? ends.first : ends.second).push_back(&endpoint);
  }
  std::vector<Disagreement> found;
  std::size_t pairs = 0;
  for (const auto& [topic, ends] : by_topic) {
    Meetings of_writers(ends.second), of_readers(ends.first);
    for (const EndpointInfo* writer : ends.first) {
      for (const EndpointInfo* reader : ends.second) {
        if (++pairs > kMaxPairs || found.size() == kMaxDisagreements) return found;
        auto reasons = mismatches(*writer, *reader);
        if (apart_by_partition_alone(reasons) && of_writers.has(*writer) && of_readers.has(*reader)) continue;
        if (!reasons.empty()) found.push_back({writer, reader, std::move(reasons)});
      }
    }
  }
  return found;
}

}  // namespace phantom::diagnostics
