#include "components/wva_server/service.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "common/core/clock.hpp"
#include "common/runtime/process.hpp"
#include "components/wva_server/dds_adapter.hpp"
#include "components/wva_server/wva_server.hpp"

namespace phantom::wva_server {
namespace {

double stopwatch_s() { return core::seconds(core::monotonic_ns()); }

core::Health starting(std::size_t done, std::size_t all, const std::string& message) {
  const double share = all == 0 ? 1.0 : static_cast<double>(done) / static_cast<double>(all);
  return {core::ComponentState::kStarting, message, {}, {{"progress", share, ""}}};
}

core::Health running(const ActivatedCell& cell) {
  const voxel::Workspace& workspace = *cell.workspace;
  const auto figure = [](const char* name, auto value, const char* unit) {
    return core::HealthFigure{name, static_cast<double>(value), unit};
  };
  return {core::ComponentState::kRunning,
          fmt::format("{} objects in {} bricks are published", cell.objects.size(), workspace.brick_count()),
          {},
          {figure("progress", 1.0, ""), figure("version", workspace.version, ""),
           figure("objects", cell.objects.size(), ""), figure("bricks", workspace.brick_count(), ""),
           figure("bytes", workspace.bytes(), "B"), figure("build_seconds", cell.build_s, "s")}};
}

void leave_report(const std::filesystem::path& folder, const std::string& cell_name,
                  const ActivatedCell& cell) {
  nlohmann::json objects = nlohmann::json::array();
  for (const ActivatedObject& object : cell.objects) {
    objects.push_back({{"id", object.id},
                       {"name", object.name},
                       {"triangles", object.report.mesh.triangles},
                       {"closed", object.report.mesh.closed},
                       {"boundary_voxels", object.report.boundary_voxels},
                       {"interior_voxels", object.report.interior_voxels}});
  }
  const nlohmann::json report = {{"cell", cell_name},
                                 {"version", cell.workspace->version},
                                 {"bricks", cell.workspace->brick_count()},
                                 {"bytes", cell.workspace->bytes()},
                                 {"build_seconds", cell.build_s},
                                 {"objects", objects}};
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "wva_server.json") << report.dump(2) << '\n';
}

}  // namespace

void run_service(const WvaServerConfig& config, const core::NetworkOptions& network,
                 const runtime::CellConfig& cell, const std::vector<runtime::CellBody>& bodies,
                 const std::filesystem::path& report_dir) {
  DdsAdapter adapter(network);
  adapter.report(starting(0, bodies.size(), "activating the workspace"));
  adapter.publish_objects(cell, bodies, config.mesh_chunk_bytes);
  // Versions rise across restarts too, so that consumers can tell a dead server's bricks from ours: seconds
  // since 1970.
  const auto version = static_cast<std::uint64_t>(core::utc_ns() / core::kNsPerSecond);
  const auto on_progress = [&](const ActivatedObject& object, std::size_t done, std::size_t all) {
    spdlog::info("{} of {}: {}", done, all, describe(object));
    if (!object.report.mesh.closed)
      spdlog::warn("{}: the mesh is not closed; check the activated shape", object.name);
    adapter.report(starting(done, all, fmt::format("activated {} of {} objects", done, all)));
  };
  const ActivatedCell activated = activate(grid_of(cell), bodies, version, stopwatch_s, on_progress,
                                           [] { return !runtime::stop_requested(); });
  if (!activated.workspace) return;
  adapter.publish_workspace(cell.name, *activated.workspace);
  const voxel::Workspace& workspace = *activated.workspace;
  spdlog::info(
      "workspace of cell {}: {} objects, {} bricks, {:.1f} MiB, built in {:.2f} s; version {} published",
      cell.name, activated.objects.size(), workspace.brick_count(),
      static_cast<double>(workspace.bytes()) / (1 << 20), activated.build_s, workspace.version);
  if (!report_dir.empty()) leave_report(report_dir, cell.name, activated);
  do {
    adapter.report(running(activated));
  } while (runtime::sleep_unless_stopped(1.0 / config.status_rate_hz));
  core::Health stopped = running(activated);
  stopped.state = core::ComponentState::kStopped;
  stopped.message = "stopped on request";
  adapter.report(stopped);
}

}  // namespace phantom::wva_server
