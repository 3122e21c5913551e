#pragma once

#include <filesystem>
#include <vector>

#include "common/core/network.hpp"
#include "common/runtime/cell.hpp"
#include "common/runtime/cell_bodies.hpp"
#include "components/wva_server/cell_changes.hpp"
#include "components/wva_server/config.hpp"

namespace phantom::wva_server {

/// What is served, and where its traces go.
struct ServedCell {
  runtime::CellConfig cell;               ///< with the changes
  CellChanges changes;                    ///< that commands made before
  std::vector<runtime::CellBody> bodies;  ///< the cell's, loaded
  std::filesystem::path changes_file;     ///< where changes are kept; empty: nowhere
  std::filesystem::path report_dir;       ///< where wva_server.json is left; empty: nowhere
};

/// Reads the cell, the changes that are kept in `changes_file` (unless that is empty or does not exist) and
/// all meshes. Throws runtime::ConfigError.
ServedCell load_served_cell(const std::filesystem::path& cell_file, const std::filesystem::path& changes_file,
                            const geometry::MeshImportOptions& limits);

/// Activates the cell, publishes it and stays for late joiners and commands until a stop is requested. Throws
/// dds::DdsError, runtime::ConfigError.
void run_service(const WvaServerConfig& config, const core::NetworkOptions& network, ServedCell served);

}  // namespace phantom::wva_server
