#pragma once

#include <filesystem>
#include <vector>

#include "common/core/network.hpp"
#include "common/runtime/cell.hpp"
#include "common/runtime/cell_bodies.hpp"
#include "components/wva_server/config.hpp"

namespace phantom::wva_server {

/// Activates the cell, publishes it and stays for late joiners and commands until a stop is requested. Leaves
/// wva_server.json in `report_dir` unless that is empty. Throws dds::DdsError, runtime::ConfigError.
void run_service(const WvaServerConfig& config, const core::NetworkOptions& network,
                 const runtime::CellConfig& cell, std::vector<runtime::CellBody> bodies,
                 const std::filesystem::path& report_dir);

}  // namespace phantom::wva_server
