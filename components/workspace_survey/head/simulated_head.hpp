#pragma once

#include <iosfwd>

#include "common/survey/simulated_ranger.hpp"

namespace phantom::workspace_survey {

/// Drives a simulated head by the contract of head_protocol.hpp: answers each line of `in` by one on `out`,
/// until `in` ends. Requests that are none are answered by an error with id 0.
void run_simulated_head(survey::SimulatedRanger& ranger, std::istream& in, std::ostream& out);

}  // namespace phantom::workspace_survey
