#pragma once

#include <iosfwd>
#include <string>

#include "common/core/network.hpp"
#include "common/runtime/command_line.hpp"

namespace phantom::phantom_sensing {

/// Arguments of `phantom_sensing command`, as they were given.
struct CommandRequest {
  std::string what;  ///< allow, forbid, list or self-test
  std::string object;
  int id = 0;
  std::string link;
  bool all = false;         ///< forbid: everything that is allowed
  double duration_s = 0.0;  ///< allow; 0: until it is forbidden
  double timeout_s = 30.0;
};

/// Declares the subcommands and their options on `command`.
void add_options(runtime::Command command, CommandRequest& request);

/// Sends the command to the phantom_sensing of the data space, waits for its reply and says it in words on
/// `print`. Returns the exit code: done, failed (it was refused, or the self-test failed) or missing (nobody
/// answers). Throws core::ConfigError for arguments that cannot be used.
int run_command(const CommandRequest& request, const core::NetworkOptions& network, std::ostream& print);

}  // namespace phantom::phantom_sensing
