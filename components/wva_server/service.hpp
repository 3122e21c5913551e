#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "common/core/network.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/cell/cell_bodies.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "components/wva_server/cell_changes.hpp"
#include "components/wva_server/config.hpp"

namespace phantom::wva_server {

/// The cell to be served, and the files that the service writes.
struct ServedCell {
  runtime::CellConfig cell;               ///< with the changes applied
  CellChanges changes;                    ///< made by earlier commands
  std::vector<runtime::CellBody> bodies;  ///< the cell's objects, loaded
  std::filesystem::path changes_file;     ///< file in which changes are kept; empty: none
  std::filesystem::path report;           ///< of what is served, as JSON; empty: none
  std::optional<std::string> leader;  ///< partition of the server whose objects are followed; none: of none
};

/// Reads the cell and checks its names, reads the changes kept in `changes_file` (unless that is empty or
/// does not exist) and all meshes. Throws runtime::ConfigError.
ServedCell load_served_cell(const std::filesystem::path& cell_file, const std::filesystem::path& changes_file,
                            const geometry::MeshImportOptions& limits);

/// Throws core::ConfigError if the topology lists its processes, and none of them is the workspace_camera
/// that `config` names as the source of live matter. `file`: of the configuration.
void check_live_source(const WvaServerConfig& config, const std::filesystem::path& file,
                       const runtime::Deployment& deployment);

/// Does all that run_service() does before it publishes: loads the arms and activates the cell, with the same
/// warnings and errors. For --check. Throws runtime::ConfigError.
void check_service(const WvaServerConfig& config, ServedCell served);

/// Activates and publishes the cell, then serves late joiners and commands until a stop is requested. Throws
/// dds::DdsError, runtime::ConfigError.
void run_service(const WvaServerConfig& config, const core::NetworkOptions& network, ServedCell served);

}  // namespace phantom::wva_server
