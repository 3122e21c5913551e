#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "common/core/network.hpp"
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

/// Does all that run_service() does before it joins the network. Throws as it does.
void check_service(const WorkspaceCameraConfig& config, LoadedCell loaded);

/// Fuses and publishes until a stop is requested. `name`: of this process in the topology. Writes
/// workspace_camera.json into `report_dir`, unless that is empty. Throws dds::DdsError, core::ConfigError.
void run_service(const WorkspaceCameraConfig& config, const core::NetworkOptions& network, LoadedCell loaded,
                 const std::string& name, const std::filesystem::path& report_dir);

}  // namespace phantom::workspace_camera
