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
  plan.ownership = first.qos.ownership;
  plan.reliable = options.reliable || options.history;
  plan.transient_local = options.history;
  plan.liveliness = diagnostics::Liveliness::kManualByTopic;
  plan.lease_ns = 0;
  for (const auto* writer : writers) {
    if (writer->type != plan.type || writer->keyed != plan.keyed) continue;
    plan.reliable = plan.reliable && writer->qos.reliability == diagnostics::Reliability::kReliable;
    plan.transient_local =
        plan.transient_local && writer->qos.durability >= diagnostics::Durability::kTransientLocal;
    plan.liveliness = std::min(plan.liveliness, writer->qos.liveliness);
    plan.lease_ns = std::max(plan.lease_ns, writer->qos.lease_ns);
  }
  return plan;
}

}  // namespace phantom::dds_spy
