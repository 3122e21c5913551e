#pragma once

#include "common/runtime/process/command_line.hpp"
#include "common/teleop/commands/operator_command.hpp"

namespace phantom::runtime {

/// Adds the subcommands with which a person commands the running master_io and slave_io: status, stop,
/// reset, home, tare and gripper, and with `settings` also percept-gain, feedback-gain, law, percept,
/// percepts and counterbalance. Exactly one of them must be given.
void add_operator_options(Command command, teleop::OperatorRequest& request, bool settings);

}  // namespace phantom::runtime
