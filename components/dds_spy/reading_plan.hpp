#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/diagnostics/graph.hpp"

namespace phantom::dds_spy {

/// What the spy's reader of a topic asks for. Never more than every writer offers: a reader that asks for
/// more is refused.
struct ReadingPlan {
  std::string type;
  bool keyed = false;
  bool reliable = false, transient_local = false;
  diagnostics::Liveliness liveliness = diagnostics::Liveliness::kAutomatic;
  std::int64_t lease_ns = diagnostics::kInfinite_ns;
  diagnostics::Ownership ownership = diagnostics::Ownership::kShared;
  bool operator==(const ReadingPlan&) const = default;
};

struct ReadingOptions {
  bool reliable = false;  ///< ask for lost samples again, where all writers offer it
  bool history = false;   ///< likewise, and for what was written before
};

/// The plan for the topic of these writers; none without a writer. Where writers disagree on type or key,
/// those of the first are read. Liveliness is asked for as weakly as the weakest writer offers it, so that
/// its loss is told.
std::optional<ReadingPlan> plan_reading(const std::vector<const diagnostics::EndpointInfo*>& writers,
                                        const ReadingOptions& options);

}  // namespace phantom::dds_spy
