#pragma once

#include <filesystem>

#include "common/runtime/process/command_line.hpp"
#include "components/synthetic_viewer/config.hpp"
#include "components/synthetic_viewer/scene/still_scene.hpp"

namespace phantom::synthetic_viewer {

/// Arguments of `synthetic_viewer sheet`.
struct SheetRequest {
  std::filesystem::path cell, out;
  StillPose pose;
  int tile_width_px = 480;
};

/// Declares the command with its options.
runtime::Command add_sheet_command(runtime::Command app, SheetRequest& request);

/// Places the arm in a cell in a pose, without any topic, and draws on one sheet the whole cell and the zone
/// where the arm's skin is nearest to an object: from the node chosen automatically and from all fourteen.
/// Prints what was visible from where. Returns an exit code; throws core::ConfigError if nothing is near the
/// arm, or something does not fit.
int run_sheet(const SheetRequest& request, const ViewerConfig& config);

}  // namespace phantom::synthetic_viewer
