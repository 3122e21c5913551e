#pragma once

#include <algorithm>
#include <fastdds/dds/core/policy/QosPolicies.hpp>

#include "common/diagnostics/graph.hpp"
#include "fast_dds/types.hpp"

namespace phantom::observation {

/// Private to common/observation.
inline diagnostics::Guid guid_of(const fast_dds::rtps::GUID_t& guid) {
  diagnostics::Guid out;
  std::copy_n(guid.guidPrefix.value, 12, out.begin());
  std::copy_n(guid.entityId.value, 4, out.begin() + 12);
  return out;
}

inline std::int64_t duration_ns(const fast_dds::Duration& duration) {
  return duration == fast_dds::infinite() ? diagnostics::kInfinite_ns : duration.to_ns();
}

inline fast_dds::Duration duration_of(std::int64_t ns) {
  if (ns == diagnostics::kInfinite_ns) return fast_dds::infinite();
  return {static_cast<std::int32_t>(ns / 1'000'000'000), static_cast<std::uint32_t>(ns % 1'000'000'000)};
}

/// Sets what readers and writers of this library have in common. `depth`: samples kept of each instance; 0:
/// all.
template <class Qos>
void set_policies(Qos& qos, const diagnostics::EndpointQos& given, int depth) {
  namespace edds = eprosima::fastdds::dds;
  qos.reliability().kind = given.reliability == diagnostics::Reliability::kReliable
                               ? edds::RELIABLE_RELIABILITY_QOS
                               : edds::BEST_EFFORT_RELIABILITY_QOS;
  qos.durability().kind = given.durability == diagnostics::Durability::kVolatile
                              ? edds::VOLATILE_DURABILITY_QOS
                              : edds::TRANSIENT_LOCAL_DURABILITY_QOS;
  qos.history().kind = depth == 0 ? edds::KEEP_ALL_HISTORY_QOS : edds::KEEP_LAST_HISTORY_QOS;
  qos.history().depth = std::max(depth, 1);
  qos.resource_limits().max_samples = 0;  // no limit: the history's depth is the limit
  qos.resource_limits().max_instances = 0;
  qos.resource_limits().max_samples_per_instance = 0;
  qos.resource_limits().allocated_samples = 16;
  qos.deadline().period = duration_of(given.deadline_ns);
  qos.liveliness().kind = static_cast<edds::LivelinessQosPolicyKind>(given.liveliness);
  qos.liveliness().lease_duration = duration_of(given.lease_ns);
  qos.ownership().kind = given.ownership == diagnostics::Ownership::kExclusive ? edds::EXCLUSIVE_OWNERSHIP_QOS
                                                                               : edds::SHARED_OWNERSHIP_QOS;
  qos.endpoint().history_memory_policy = fast_dds::rtps::DYNAMIC_REUSABLE_MEMORY_MODE;
  qos.data_sharing().off();
}

}  // namespace phantom::observation
