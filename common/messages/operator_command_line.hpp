#pragma once

#include <iosfwd>
#include <string>

#include "common/core/network.hpp"
#include "common/teleop/commands/operator_command.hpp"

namespace phantom::messages {

/// Sends a person's request to the running master_io and slave_io, and prints each side's answer. `issuer`
/// goes into their logs. A reset names the stops that the two report as in force. Blocks until both sides are
/// heard, for two seconds at most, or for a reset for request.timeout_s if that is longer; a stop does not
/// wait for them. Then blocks until they have answered, for request.timeout_s at most. Throws DdsError.
teleop::OperatorOutcome run_operator_request(const core::NetworkOptions& network, const std::string& issuer,
                                             const teleop::OperatorRequest& request, std::ostream& print);

}  // namespace phantom::messages
