#pragma once

#include "common/core/operator_command.hpp"
#include "common/runtime/command_line.hpp"

namespace phantom::runtime {

/// Adds the subcommands with which a person commands the running master_io and slave_io: status, stop,
/// reset, home, tare and gripper, and with `settings` also percept-gain, feedback-gain, law, percept,
/// percepts and counterbalance. Exactly one of them must be given.
void add_operator_options(Command command, core::OperatorRequest& request, bool settings);

}  // namespace phantom::runtime
