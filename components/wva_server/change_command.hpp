#pragma once

#include <iosfwd>
#include <string>

#include "common/core/network.hpp"
#include "common/runtime/command_line.hpp"

namespace phantom::wva_server {

/// Arguments of `wva_server command`, as they were given.
struct ChangeRequest {
  std::string what;  ///< add, move, remove or list
  std::string file;  ///< add: YAML of one object; "-" is the standard input
  std::string object;
  int id = 0;
  std::string pose;    ///< move: "x y z roll pitch yaw", m and degrees
  int guard_vox = -1;  ///< move: −1: as before
  double timeout_s = 30.0;
};

/// Declares the subcommands and their options on `command`.
void add_options(runtime::Command command, ChangeRequest& request);

/// Sends the command to the wva_server of the data space, waits for its reply and says it in words on
/// `print`. Returns the exit code: done, failed (it was refused) or missing (nobody answers). Throws
/// core::ConfigError for arguments that cannot be used.
int run_change(const ChangeRequest& request, const core::NetworkOptions& network, std::ostream& print);

}  // namespace phantom::wva_server
