#pragma once

#include <iosfwd>
#include <string>

#include "common/core/network.hpp"
#include "common/core/operator_request.hpp"

namespace phantom::dds {

/// Asks the running master_io and slave_io for what a person wants, and prints what each says to it. `issuer`
/// goes into their logs. A reset names the stops that the two say are in force. Blocks until the two are
/// heard, for two seconds at most and for a reset request.timeout_s if that is longer (a stop waits for
/// nobody), and then until they have answered, for request.timeout_s at most. Throws DdsError.
core::OperatorOutcome run_operator_request(const core::NetworkOptions& network, const std::string& issuer,
                                           const core::OperatorRequest& request, std::ostream& print);

}  // namespace phantom::dds
