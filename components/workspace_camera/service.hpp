#pragma once

#include <filesystem>
#include <string>

#include "common/core/network.hpp"
#include "components/workspace_camera/loaded_cell.hpp"

namespace phantom::workspace_camera {

/// Does all that run_service() does before it joins the network. Throws as it does.
void check_service(const WorkspaceCameraConfig& config, LoadedCell loaded);

/// Fuses and publishes until a stop is requested. `name`: of this process in the topology. Writes
/// workspace_camera.json into `report_dir`, unless that is empty. Throws dds::DdsError, core::ConfigError.
void run_service(const WorkspaceCameraConfig& config, const core::NetworkOptions& network, LoadedCell loaded,
                 const std::string& name, const std::filesystem::path& report_dir);

}  // namespace phantom::workspace_camera
