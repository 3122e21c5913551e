#pragma once

#include <iosfwd>
#include <string>

#include "common/core/network.hpp"
#include "common/runtime/process/command_line.hpp"

namespace phantom::wva_server {

/// The arguments of `wva_server command`, unchecked.
struct ChangeRequest {
  std::string what;  ///< the subcommand
  std::string file;  ///< add: file with the YAML of one object; "-": standard input
  std::string object;
  int id = 0;
  std::string name;        ///< name: the new one
  std::string arm, frame;  ///< attach, release: as in WorkspaceCommand
  std::string pose;        ///< move, attach, release: "x y z roll pitch yaw", m and degrees; empty: not given
  int guard_vox = -1;      ///< move, release: guard skin in voxels; −1: unchanged
  double timeout_s = 30.0;
};

/// Declares the subcommands and their options on `command`.
void add_options(runtime::Command command, ChangeRequest& request);

/// Sends the command to the wva_server of the data space, waits for its reply and prints it in words on
/// `print`. Returns the exit code: done, failed (refused, or not done in time) or missing (nobody answers).
/// Throws core::ConfigError for arguments that cannot be used.
int run_change(const ChangeRequest& request, const core::NetworkOptions& network, std::ostream& print);

}  // namespace phantom::wva_server
