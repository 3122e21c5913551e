#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include "common/fusion/camera_scene.hpp"
#include "common/runtime/cell/cell.hpp"
#include "components/workspace_camera/arm_view.hpp"
#include "components/workspace_camera/config.hpp"
#include "components/workspace_camera/simulated_camera.hpp"

namespace phantom::workspace_camera {

/// What is loaded before the process joins a network.
struct LoadedCell {
  runtime::CellConfig cell;
  std::unique_ptr<ArmView> arm;                          ///< null: none is masked
  std::unique_ptr<const fusion::CameraScene> simulated;  ///< of the real cell; null: no camera is simulated
  std::vector<DisplacedMesh> displaced;                  ///< which are not in `simulated`
  std::vector<std::pair<std::uint64_t, geometry::TriangleMesh>>
      meshes;  ///< of the cell's objects, by hash, in the cell's order
};

/// Loads the cell's arm and objects. Throws core::ConfigError, core::MissingError.
LoadedCell load_cell(const WorkspaceCameraConfig& config, const std::filesystem::path& cell_file);

}  // namespace phantom::workspace_camera
