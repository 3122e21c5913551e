#pragma once

#include <filesystem>

#include "common/runtime/command_line.hpp"
#include "components/synthetic_viewer/config.hpp"
#include "components/synthetic_viewer/still_scene.hpp"

namespace phantom::synthetic_viewer {

/// What `synthetic_viewer sheet` is asked for.
struct SheetRequest {
  std::filesystem::path cell, out;
  StillPose pose;
  int tile_width_px = 480;
};

/// Adds the command with its options.
runtime::Command add_sheet_command(runtime::Command app, SheetRequest& request);

/// Puts the arm into a cell in a pose and draws, without any topic, the whole cell and the zone where its
/// skin is nearest to an object: from the node chosen automatically and from all fourteen, on one sheet.
/// Prints what was seen from where. Returns an exit code; throws core::ConfigError if nothing is near the
/// arm, or something does not fit.
int run_sheet(const SheetRequest& request, const ViewerConfig& config);

}  // namespace phantom::synthetic_viewer
