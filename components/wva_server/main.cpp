#include <spdlog/spdlog.h>

#include <filesystem>
#include <future>
#include <iostream>
#include <optional>

#include "common/dds/endpoints/participant.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/process/process.hpp"
#include "common/workspace/large_pages.hpp"
#include "components/wva_server/activate_command.hpp"
#include "components/wva_server/change_command.hpp"
#include "components/wva_server/service.hpp"
#include "components/wva_server/step_check.hpp"

int main(int argc, char** argv) {
  using namespace phantom;
  wva_server::ActivateRequest request;
  wva_server::ChangeRequest change;
  std::filesystem::path changes_file;
  std::optional<double> weber_fraction;
  std::optional<std::string> leader;
  runtime::Command activate, command;
  runtime::ProcessDescription description;
  description.name = "wva_server";
  description.summary =
      "Turns the cell's CAD models into graded, viscous space: "
      "reads every object's mesh, voxelises it at its pose, wraps it in neighbour layers, "
      "merges all into one workspace and publishes it. "
      "Stays for those who join later, and to add, move and remove objects on command, or let an arm carry them.";
  description.details =
      "Topics out: workspace_brick, workspace_version, workspace_object, mesh_chunk, workspace_reply, live_object, "
      "component_status; in: workspace_command, slave_state, gripper_state, occupancy_change.\n"
      "Example while it runs: wva_server command move --object pump --pose \"0.4 -0.1 0.301 0 0 30\"\n"
      "Example without DDS: wva_server activate --mesh part.stl --scale 0.001 --voxel-size-m 0.005 "
      "--layers 4,4,4,4,4,4 --mu 32,20,13,11,10,9 --export part.nrrd";
  description.add_options = [&](runtime::Command app) {
    app.option(
        "--keep-changes", changes_file,
        "keep in this file what commands change, and serve the cell with these changes after a restart");
    app.option("--weber-fraction", weber_fraction,
               "with --check: warn of neighbouring layers whose viscosities differ by less than this share, "
               "which an operator just notices (master_io jnd measures it)")
        .between(0.001, 10.0);
    app.option(
        "--follow", [&leader](const std::string& partition) { leader = partition; },
        "follow the objects of the wva_server in this DDS partition (\"\": the default one), of the same cell "
        "in voxels of another size; commands go to that one");
    activate = app.subcommand("activate",
                              "activate one mesh or a cell, export it as NRRD, print a line of JSON; no DDS");
    wva_server::add_options(activate, request);
    command = app.subcommand(
        "command",
        "tell the running wva_server of the deployment to add, move or remove an object, to let an arm carry it, or what it has");
    wva_server::add_options(command, change);
  };
  description.parameters = {wva_server::kParameters};
  description.run = [&](const runtime::ProcessOptions& options) {
    workspace::keep_freed_memory(256 << 20);
    const auto config = wva_server::load_config(options.config);
    if (activate.given()) return wva_server::run_activate(request, config, std::cout);
    if (weber_fraction && !options.check)
      throw core::ConfigError("--weber-fraction: is for a check; allowed: with --check");
    const auto deployment = runtime::load_deployment(options);
    if (command.given()) return wva_server::run_change(change, deployment.network, std::cout);
    std::optional<runtime::EndsAtOnce> starting(std::in_place);
    // Fast DDS needs as long for the profiles as the cell for its meshes: run both at once.
    auto profiles = std::async(std::launch::async, dds::check_qos_profiles, deployment.network.qos_profiles);
    runtime::require_files(deployment);
    auto served = wva_server::load_served_cell(deployment.cell, changes_file, config.mesh_import);
    if (!config.arm.empty()) served.cell.arm(config.arm);  // throws if there is none
    wva_server::check_live_source(config, options.config, deployment);
    profiles.get();
    if (options.check) {
      const std::string found =
          ": " + std::to_string(served.bodies.size()) + " objects in cell " + served.cell.name;
      if (weber_fraction)
        for (const std::string& warning :
             wva_server::unnoticed_step_warnings(served.cell, served.bodies, *weber_fraction))
          spdlog::warn("{}", warning);
      wva_server::check_service(config, std::move(served));
      return runtime::configuration_is_valid(found);
    }
    starting.reset();
    if (!options.report_dir.empty())
      served.report =
          options.report_dir / ((options.name.empty() ? options.component : options.name) + ".json");
    if (leader == deployment.network.partition)
      throw core::ConfigError("--follow: '" + *leader +
                              "' is this server's own partition; allowed: another one");
    served.leader = leader;
    wva_server::run_service(config, deployment.network, std::move(served));
    return static_cast<int>(runtime::kExitDone);
  };
  return runtime::process_main(argc, argv, description);
}
