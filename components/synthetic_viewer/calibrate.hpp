#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/runtime/process/command_line.hpp"
#include "components/synthetic_viewer/config.hpp"

namespace phantom::synthetic_viewer {

/// Arguments of `synthetic_viewer calibrate`.
struct CalibrateRequest {
  std::filesystem::path camera;                 ///< its file
  std::vector<std::filesystem::path> pictures;  ///< of the board
  int take = 0;                                 ///< so many pictures of the board are taken from the camera
  std::filesystem::path snapshot;               ///< PNG of the camera's next picture, to pick corners in
  std::string board;                            ///< "9x6" inner corners
  double square_mm = 25.0;
  std::vector<double> board_pose;  ///< of the first picture's board in W: x y z (m), roll pitch yaw (degrees)
  std::vector<std::string> picks;  ///< see parse_pick()
  std::filesystem::path cell;
  double pixel_sigma_px = 1.0, largest_residual_px = 6.0;
  std::filesystem::path out;
};

/// Declares the command with its options.
runtime::Command add_calibrate_command(runtime::Command app, CalibrateRequest& request);

/// Calibrates a camera without any topic: its lens from pictures of a checkerboard, its pose from the board
/// or from corners that were picked, and writes the result. Prints what it found and how good it is. Returns
/// an exit code; throws core::ConfigError for what does not fit or does not determine a camera,
/// core::MissingError for what is not there.
int run_calibrate(const CalibrateRequest& request, const ViewerConfig& config);

}  // namespace phantom::synthetic_viewer
