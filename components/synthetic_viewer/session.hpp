#pragma once

#include <filesystem>

#include "common/core/network.hpp"
#include "common/runtime/cell.hpp"
#include "components/synthetic_viewer/config.hpp"

namespace phantom::synthetic_viewer {

/// Runs the viewer until a stop is requested: drawing thread, topics, page and, if one is wanted and there is
/// a display, window. Without a display it logs that and continues without a window. Throws
/// core::MissingError if there is no OpenGL, no port for the page, or a link's mesh is missing.
void run_session(ViewerConfig config, const runtime::CellConfig& cell, const core::NetworkOptions& network,
                 const std::filesystem::path& report_dir);

}  // namespace phantom::synthetic_viewer
