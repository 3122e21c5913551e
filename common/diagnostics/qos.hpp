#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace phantom::diagnostics {

enum class Reliability { kBestEffort, kReliable };
enum class Durability { kVolatile, kTransientLocal, kTransient, kPersistent };  // in rising order
enum class Liveliness { kAutomatic, kManualByParticipant, kManualByTopic };     // in rising order
enum class Ownership { kShared, kExclusive };
enum class DestinationOrder { kByReception, kBySource };         // in rising order
enum class AccessScope { kInstance, kTopic, kGroup };            // in rising order
enum class Representation { kXcdr1 = 0, kXml = 1, kXcdr2 = 2 };  // values as sent in RTPS

inline constexpr std::int64_t kInfinite_ns = std::numeric_limits<std::int64_t>::max();

/// The QoS that an endpoint announces (DDS 1.4, 2.2.3); defaults as in the standard.
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
  bool operator==(const EndpointQos&) const = default;
};

/// A reason why a writer and a reader of one topic do not communicate.
struct Mismatch {
  std::string policy;     ///< "deadline"
  std::string offered;    ///< by the writer: "none"
  std::string requested;  ///< by the reader: "20 ms"
  std::string rule;       ///< why the two are incompatible
  std::string advice;     ///< what to do
};

/// Returns every reason why the two do not match, by the rules of DDS 1.4 (requested ≤ offered), partitions,
/// and XTypes 1.3 for representations; empty if they match.
std::vector<Mismatch> mismatches(const EndpointQos& offered, const EndpointQos& requested);

/// Returns whether endpoints with these partitions share one, by name or by pattern; no name means the
/// default partition.
bool share_a_partition(std::vector<std::string> a, std::vector<std::string> b);

/// Returns "20 ms", "1.5 s", or "none" for kInfinite_ns.
std::string duration_text(std::int64_t duration_ns);
std::string to_string(Reliability value);
std::string to_string(Durability value);
std::string to_string(Liveliness value);
std::string to_string(Ownership value);
std::string to_string(Representation value);
/// Returns "default", or the names.
std::string partitions_text(const std::vector<std::string>& partitions);
/// Returns the policies that differ from the standard's default, on one line: "reliable, transient local,
/// deadline 20 ms".
std::string qos_text(const EndpointQos& qos);

}  // namespace phantom::diagnostics
