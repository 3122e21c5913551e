#pragma once

#include <filesystem>
#include <iosfwd>
#include <string>
#include <vector>

#include "common/core/network.hpp"
#include "common/runtime/command_line.hpp"
#include "components/workspace_survey/config.hpp"

namespace phantom::workspace_survey {

/// What a call is to do, as it was given.
struct Request {
  std::string what;  ///< simulate, identify, fit or assist
  std::filesystem::path library, measurements, out, picture, json;
  std::string part;  ///< simulate, practice: which; fit: only this one
  std::string pose;  ///< simulate, practice: "x y z roll pitch yaw", m and degrees
  int faces = 2;
  unsigned seed = 1;
  std::vector<std::string> range_errors;  ///< "NODE=MM"
  double voxel_size_mm = 0.0;             ///< 0: the cell's
  bool send = false;
  std::string name, move;
  double timeout_s = 30.0;
};

/// Declares the subcommands and their options.
void add_options(runtime::Command app, Request& request);

/// Where the workspace is, for who sends.
struct Workspace {
  core::NetworkOptions network;
  double voxel_size_m = 0.01;
};

/// Does what was asked for, telling it on `print`; `in` is for the assistant. Returns the exit code: done;
/// failed where the measurement is refused or the server refuses; missing if nobody answers. Throws
/// core::ConfigError for arguments and files that cannot be used.
int run(const Request& request, const Config& config, const Workspace& workspace, std::istream& in,
        std::ostream& print);

}  // namespace phantom::workspace_survey
