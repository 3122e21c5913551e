#include <algorithm>
#include <future>
#include <optional>

#include "common/dds/endpoints/participant.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "common/runtime/process/process.hpp"
#include "components/workspace_camera/service.hpp"

int main(int argc, char** argv) {
  using namespace phantom;
  runtime::ProcessDescription description;
  description.name = "workspace_camera";
  description.summary =
      "Turns what depth cameras see into changes of the workspace's occupancy: masks the arm at each image's own "
      "time, fuses the images, tells wva_server what has come and gone, and reports objects that stand elsewhere than the "
      "model has them.";
  description.details =
      "Topics in: depth_image, slave_state, gripper_state, workspace_version, workspace_object. Topics out: occupancy_change, "
      "space_view, pose_finding, component_status.\n"
      "Example: workspace_camera --deployment deploy/topologies/live.yaml";
  description.parameters = {workspace_camera::kParameters};
  description.run = [](const runtime::ProcessOptions& options) {
    const auto config = workspace_camera::load_config(options.config);
    const auto deployment = runtime::load_deployment(options);
    if (config.has(workspace_camera::CameraDriver::kSimulated))
      runtime::require_simulation_meant(deployment, options, options.config.string() + ": driver: sim");
    if (config.has(workspace_camera::CameraDriver::kFiles))
      runtime::require_simulation_meant(deployment, options, options.config.string() + ": driver: files");
    if (std::ranges::any_of(config.cameras, [](const workspace_camera::CameraConfig& camera) {
          return camera.driver == workspace_camera::CameraDriver::kOpenNi && camera.openni.is_recording();
        }))
      runtime::require_simulation_meant(deployment, options,
                                        options.config.string() + ": openni.device: a recording");
    std::optional<runtime::EndsAtOnce> starting(std::in_place);
    auto profiles = std::async(std::launch::async, dds::check_qos_profiles, deployment.network.qos_profiles);
    auto loaded = workspace_camera::load_cell(config, deployment.cell);
    profiles.get();
    if (options.check) {
      workspace_camera::check_service(config, std::move(loaded));
      return runtime::configuration_is_valid(": " + std::to_string(config.cameras.size()) + " cameras");
    }
    starting.reset();
    const std::string name = options.name.empty() ? options.component : options.name;
    workspace_camera::run_service(config, deployment.network, std::move(loaded), name, options.report_dir);
    return static_cast<int>(runtime::kExitDone);
  };
  return runtime::process_main(argc, argv, description);
}
