#pragma once

#include "common/core/clock.hpp"
#include "common/dds/endpoints/topics.hpp"
#include "common/diagnostics/qos.hpp"

namespace phantom::observation {

/// Returns the contract of one of the project's topics as the QoS that its endpoints announce.
inline diagnostics::EndpointQos contract_qos(const dds::QosContract& contract) {
  const auto duration_ns = [](int ms) {
    return ms == 0 ? diagnostics::kInfinite_ns : ms * core::kNsPerMillisecond;
  };
  diagnostics::EndpointQos qos;
  qos.reliability = static_cast<diagnostics::Reliability>(contract.reliability);
  qos.durability = static_cast<diagnostics::Durability>(contract.durability);
  qos.deadline_ns = duration_ns(contract.deadline_ms);
  qos.lease_ns = duration_ns(contract.liveliness_ms);
  if (contract.liveliness_ms > 0) qos.liveliness = diagnostics::Liveliness::kManualByTopic;
  return qos;
}

}  // namespace phantom::observation
