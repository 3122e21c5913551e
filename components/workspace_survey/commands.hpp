#pragma once

#include <filesystem>
#include <iosfwd>
#include <optional>
#include <string>
#include <vector>

#include "common/core/network.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/process/command_line.hpp"
#include "components/workspace_survey/config.hpp"

namespace phantom::workspace_survey {

/// The command line's arguments, unchecked.
struct Request {
  std::string what;  ///< parts, simulate, identify, fit, assist, simulate_head or touch
  std::filesystem::path library, measurements, out, picture, json;
  std::filesystem::path page, view;  ///< page of candidates to write; picture of the cell for it
  std::size_t pick = 0;              ///< fit: a person's choice on that page; 0: none
  std::string part;                  ///< simulate, practice: the part; fit: only this part
  std::string pose;                  ///< simulate, practice: "x y z roll pitch yaw", m and degrees
  int faces = 2;
  unsigned seed = 1;
  std::vector<std::string> range_errors;  ///< "NODE=MM": added to the node's range
  double voxel_size_mm = 0.0;             ///< 0: the cell's
  bool send = false;
  std::string name, move;
  double timeout_s = 30.0;
  std::string driver;                   ///< assist: the command that starts the driver of the range head
  double driver_timeout_s = 30.0;       ///< assist: for each of its answers
  int readings = 5;                     ///< assist: of a corner by that head
  std::optional<int> serve;             ///< assist: the port of its page; 0: any free one
  std::string object, arm;              ///< touch: what is touched, and by which of the cell's arms
  int touches = 6;                      ///< touch: so many
  double wait_s = 120.0;                ///< touch: for the next contact
  std::optional<double> tip_radius_mm;  ///< touch: of the ball at the arm's tip
  bool apply = false;                   ///< touch: without asking
  bool kept = false;                    ///< touch: begin with the places that phantom_sensing has kept
};

/// Declares the subcommands and their options.
void add_options(runtime::Command app, Request& request);

/// The workspace to which an object is sent.
struct Workspace {
  core::NetworkOptions network;
  workspace::VoxelSize voxel_size_m = 0.01;
  runtime::CellConfig cell = {};
};

/// Carries out the request and prints the result on `print`; the assistant reads from `in`. Returns the exit
/// code: done; failed if the measurement or the server refuses; missing if nobody answers. Throws
/// core::ConfigError for arguments and files that cannot be used.
int run(const Request& request, const Config& config, const Workspace& workspace, std::istream& in,
        std::ostream& print);

}  // namespace phantom::workspace_survey
