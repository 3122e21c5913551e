#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/diagnostics/graph.hpp"

namespace phantom::dds_spy {

/// The QoS that the spy's reader of a topic requests. It never exceeds what every writer offers, because such
/// a reader would not match.
struct ReadingPlan {
  std::string type;
  bool keyed = false;
  diagnostics::EndpointQos qos;
  bool operator==(const ReadingPlan&) const = default;
};

struct ReadingOptions {
  bool reliable = false;  ///< request repetition of lost samples, where all writers offer it
  bool history = false;   ///< likewise, and request samples written earlier
};

/// Returns the plan for the topic of these writers; none without a writer. Where writers differ in type or
/// key, those like the first are read. Requests liveliness as weakly as the weakest writer offers it, so that
/// its loss is reported.
std::optional<ReadingPlan> plan_reading(const std::vector<const diagnostics::EndpointInfo*>& writers,
                                        const ReadingOptions& options);

}  // namespace phantom::dds_spy
