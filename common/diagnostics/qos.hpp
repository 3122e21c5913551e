#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace phantom::diagnostics {

enum class Reliability { kBestEffort, kReliable };
enum class Durability { kVolatile, kTransientLocal, kTransient, kPersistent };  // rising
enum class Liveliness { kAutomatic, kManualByParticipant, kManualByTopic };     // rising
enum class Ownership { kShared, kExclusive };
enum class DestinationOrder { kByReception, kBySource };         // rising
enum class AccessScope { kInstance, kTopic, kGroup };            // rising
enum class Representation { kXcdr1 = 0, kXml = 1, kXcdr2 = 2 };  // as on the wire

inline constexpr std::int64_t kInfinite_ns = std::numeric_limits<std::int64_t>::max();

/// What an endpoint announces of its QoS (DDS 1.4, 2.2.3); defaults as in the standard.
struct EndpointQos {
  Reliability reliability = Reliability::kBestEffort;
  Durability durability = Durability::kVolatile;
  std::int64_t deadline_ns = kInfinite_ns;
  Liveliness liveliness = Liveliness::kAutomatic;
  std::int64_t lease_ns = kInfinite_ns;
  std::int64_t lifespan_ns = kInfinite_ns;  ///< writers only
  std::int64_t latency_budget_ns = 0;
  Ownership ownership = Ownership::kShared;
  DestinationOrder destination_order = DestinationOrder::kByReception;
  AccessScope access_scope = AccessScope::kInstance;
  bool coherent_access = false, ordered_access = false;
  std::vector<std::string> partitions;          ///< none: the default partition
  std::vector<Representation> representations;  ///< none: XCDR1
};

/// A reason why a writer and a reader of one topic do not communicate.
struct Mismatch {
  std::string policy;     ///< "deadline"
  std::string offered;    ///< by the writer: "none"
  std::string requested;  ///< by the reader: "20 ms"
  std::string rule;       ///< why that does not fit
  std::string advice;     ///< what to do
};

/// Every reason why the two do not match, by the rules of DDS 1.4 (requested ≤ offered), partitions, and
/// XTypes 1.3 for representations; empty if they do.
std::vector<Mismatch> mismatches(const EndpointQos& offered, const EndpointQos& requested);

/// Whether ends with these partitions meet, by name or by pattern; none is the default partition.
bool share_a_partition(std::vector<std::string> a, std::vector<std::string> b);

/// "20 ms", "1.5 s", "none" for kInfinite_ns.
std::string duration_text(std::int64_t duration_ns);
std::string to_string(Reliability value);
std::string to_string(Durability value);
std::string to_string(Liveliness value);
std::string to_string(Ownership value);
std::string to_string(Representation value);
/// "default", or the names.
std::string partitions_text(const std::vector<std::string>& partitions);
/// The policies that are not the standard's default, on a line: "reliable, transient local, deadline 20 ms".
std::string qos_text(const EndpointQos& qos);

}  // namespace phantom::diagnostics
