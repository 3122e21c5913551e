#include "components/wva_server/service_setup.hpp"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>

#include "common/core/clock.hpp"
#include "common/core/errors.hpp"
#include "common/core/text.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell_names.hpp"

namespace phantom::wva_server {
namespace {

std::string place_of(const std::string& partition) {
  return partition.empty() ? "in the domain's default partition" : "in partition '" + partition + "'";
}

}  // namespace

AddLimits add_limits(const WvaServerConfig& config) {
  AddLimits limits{config.mesh_import, config.max_voxel_bytes, config.command_mesh_bytes,
                   config.command_steps, config.command_objects};
  limits.mesh.max_triangles = std::min(limits.mesh.max_triangles, config.command_triangles);
  limits.mesh.max_cpu_s = std::min(limits.mesh.max_cpu_s, config.command_import_s);
  return limits;
}

void warn_of(const ServedObject& object) {
  for (const std::string& note : object.notes) spdlog::warn("{}: {}", object.config.name, note);
  if (!object.report.mesh.closed)
    spdlog::warn("{}: the mesh is not closed; check the activated shape", object.config.name);
}

GraspWatch grasp_watch(const runtime::CellConfig& cell, const Carriers& carriers,
                       const WvaServerConfig& config) {
  if (!config.automatic_grasp || carriers.followed() == nullptr) return {{}, "", ""};
  const runtime::ArmConfig& arm = cell.arm(carriers.followed_name());
  constexpr double kPitch_m = 0.004;
  return {runtime::load_fingers(arm, *carriers.followed(), kPitch_m), arm.name, last_link_of(arm)};
}

std::string refusal_of(const WvaServerConfig& config, const ServedCell& served) {
  if (!config.accept_commands)
    return "this wva_server takes no commands (accept_commands is false in its configuration)";
  if (!served.leader) return "";
  return "this wva_server follows the one " + place_of(*served.leader) + "; send the command there";
}

ServedCell load_served_cell(const std::filesystem::path& cell_file, const std::filesystem::path& changes_file,
                            const geometry::MeshImportOptions& limits) {
  ServedCell served;
  served.cell = runtime::load_checked_cell(cell_file, runtime::CellArms::kOptional);
  served.changes = no_changes(served.cell);
  served.changes_file = changes_file;
  if (!changes_file.empty()) {
    const auto folder = std::filesystem::absolute(changes_file).parent_path();
    if (!std::filesystem::is_directory(folder)) {
      throw core::MissingError("--keep-changes: " + changes_file.string() + ": there is no folder " +
                               folder.string() + " to keep it in");
    }
    if (auto kept = read_changes(served.cell, changes_file)) served.changes = std::move(*kept);
  }
  apply(served.changes, served.cell);
  if (!served.changes.objects.empty()) {
    spdlog::info("differing from the cell file, as commands left them: {} ({})",
                 served.changes.objects.size(), changes_file.string());
  }
  served.bodies = runtime::load_bodies(served.cell, limits);
  return served;
}

void check_live_source(const WvaServerConfig& config, const std::filesystem::path& file,
                       const runtime::Deployment& deployment) {
  std::string cameras;
  bool is_known = deployment.hosts.empty() || !config.live.wanted();
  for (const runtime::DeployedHost& host : deployment.hosts) {
    for (const runtime::DeployedProcess& process : host.processes) {
      if (process.component != "workspace_camera") continue;
      core::add_to_list(cameras, process.name);
      is_known = is_known || process.name == config.live.source;
    }
  }
  if (!is_known)
    throw core::ConfigError(
        fmt::format("{}: live.source: {} has no workspace_camera called '{}'; allowed: {}", file.string(),
                    deployment.file.string(), config.live.source,
                    cameras.empty() ? "\"\" (no live matter), as it has none" : cameras));
}

void check_service(const WvaServerConfig& config, ServedCell served) {
  const Carriers carriers(load_carriers(served.cell), config.arm, config.arm_staleness_s);
  grasp_watch(served.cell, carriers, config);
  LiveCell cell(served.cell, add_limits(config), served.changes);
  layers::ActivationOptions options;
  options.threads = config.threads;
  options.stopwatch = [] { return core::seconds(core::monotonic_ns()); };
  const auto change = cell.activate(std::move(served.bodies), 1, options,
                                    [](const ServedObject& object, std::size_t) { warn_of(object); });
  if (!change) throw core::ConfigError("object " + change.status().message());
}

}  // namespace phantom::wva_server
