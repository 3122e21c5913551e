#include "components/dds_spy/reading_plan.hpp"

#include <algorithm>

namespace phantom::dds_spy {

std::optional<ReadingPlan> plan_reading(const std::vector<const diagnostics::EndpointInfo*>& writers,
                                        const ReadingOptions& options) {
  if (writers.empty()) return std::nullopt;
  const diagnostics::EndpointInfo& first = *writers.front();
  ReadingPlan plan;
  plan.type = first.type;
  plan.keyed = first.keyed;
  diagnostics::EndpointQos& qos = plan.qos;
  qos.ownership = first.qos.ownership;
  if (options.reliable || options.history) qos.reliability = diagnostics::Reliability::kReliable;
  if (options.history) qos.durability = diagnostics::Durability::kTransientLocal;
  qos.liveliness = diagnostics::Liveliness::kManualByTopic;
  qos.lease_ns = 0;
  for (const auto* writer : writers) {
    if (writer->type != plan.type || writer->keyed != plan.keyed) continue;
    qos.reliability = std::min(qos.reliability, writer->qos.reliability);
    qos.durability = std::min(qos.durability, writer->qos.durability);
    qos.liveliness = std::min(qos.liveliness, writer->qos.liveliness);
    qos.lease_ns = std::max(qos.lease_ns, writer->qos.lease_ns);
  }
  return plan;
}

}  // namespace phantom::dds_spy
