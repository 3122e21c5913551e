#pragma once

#include <iosfwd>
#include <string>

#include "common/core/network.hpp"
#include "common/runtime/process/command_line.hpp"

namespace phantom::phantom_sensing {

/// Arguments of `phantom_sensing command`, as given.
struct CommandRequest {
  std::string what;  ///< allow, forbid, list or self-test
  std::string object;
  int id = 0;
  std::string link;
  bool all = false;         ///< forbid: all allowed contacts
  double duration_s = 0.0;  ///< allow: how long; 0: until it is forbidden
  double timeout_s = 30.0;
};

/// Declares the subcommands and their options on `command`.
void add_options(runtime::Command command, CommandRequest& request);

/// Sends the command to the phantom_sensing of the DDS domain, waits for its reply and prints that on
/// `print`. Returns the exit code: done, failed (the command was refused or the self-test failed) or missing
/// (no reply). Throws core::ConfigError for unusable arguments.
int run_command(const CommandRequest& request, const core::NetworkOptions& network, std::ostream& print);

}  // namespace phantom::phantom_sensing
