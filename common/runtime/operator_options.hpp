#pragma once

#include "common/core/operator_request.hpp"
#include "common/runtime/command_line.hpp"

namespace phantom::runtime {

/// Adds the subcommands by which a person asks something of the running master_io and slave_io: status, stop
/// and reset, and with `settings` also percept-gain, feedback-gain, law and percept. One of them is needed.
void add_operator_options(Command command, core::OperatorRequest& request, bool settings);

}  // namespace phantom::runtime
