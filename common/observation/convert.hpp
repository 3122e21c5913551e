#pragma once

#include <fastdds/rtps/common/Guid.h>

#include <algorithm>
#include <fastdds/dds/core/policy/QosPolicies.hpp>

#include "common/diagnostics/graph.hpp"

namespace phantom::observation {

/// Private to common/observation.
inline diagnostics::Guid guid_of(const eprosima::fastrtps::rtps::GUID_t& guid) {
  diagnostics::Guid out;
  std::copy_n(guid.guidPrefix.value, 12, out.begin());
  std::copy_n(guid.entityId.value, 4, out.begin() + 12);
  return out;
}

inline std::int64_t duration_ns(const eprosima::fastrtps::Duration_t& duration) {
  return duration == eprosima::fastrtps::c_TimeInfinite ? diagnostics::kInfinite_ns : duration.to_ns();
}

inline eprosima::fastrtps::Duration_t duration_of(std::int64_t ns) {
  if (ns == diagnostics::kInfinite_ns) return eprosima::fastrtps::c_TimeInfinite;
  return {static_cast<std::int32_t>(ns / 1'000'000'000), static_cast<std::uint32_t>(ns % 1'000'000'000)};
}

}  // namespace phantom::observation
