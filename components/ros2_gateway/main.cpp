#include <fstream>
#include <sstream>

#include "common/dds/endpoints/participant.hpp"
#include "common/runtime/cell/arm_model.hpp"
#include "common/runtime/cell/cell.hpp"
#include "common/runtime/cell/cell_names.hpp"
#include "common/runtime/process/process.hpp"
#include "components/ros2_gateway/service.hpp"

int main(int argc, char** argv) {
  using namespace phantom;
  runtime::ProcessDescription description;
  description.name = "ros2_gateway";
  description.summary =
      "Joins a ROS 2 domain as a node, without ROS 2. The joint_states of a robot there become the arm whose "
      "vicinity is felt: wva_server, phantom_sensing and this process are enough.";
  description.details =
      "In, of the ROS 2 domain: joint_states, collision_object, a wrench; TwistStamped or Joy as a master; a "
      "sensor's PointCloud2 or depth images; a camera's Image or CompressedImage. Out there: phantom/joint_states, phantom/master/joint_states, "
      "phantom/robot_description, phantom/percept/{drag,drag_wrench,torque_wrench,closeness,speed,worst_place}, "
      "phantom/workspace/{meshes,boundary,guard,layer_N}, phantom/views/{main,hit,tool,camera}/compressed, tf, "
      "tf_static, diagnostics.\n"
      "In, of Phantom's: slave_state, master_state, percept, hit_alert, component_status, the workspace, "
      "view_picture, haptic_device_wrench. Out there: slave_state, wrist_wrench, sensor_points, camera_picture, "
      "haptic_device, workspace_command, component_status.\n"
      "Example: ros2_gateway --deployment deploy/topologies/ros2_arm.yaml";
  description.parameters = {ros2_gateway::kParameters};
  description.run = [&](const runtime::ProcessOptions& options) {
    auto config = ros2_gateway::load_config(options.config);
    const auto deployment = runtime::load_deployment(options);
    const auto cell = runtime::load_checked_cell(deployment);
    const auto arm = runtime::load_arm(cell.arm(config.arm));
    config.workspace.arm = cell.arm(config.arm).name;
    for (const auto& object : cell.objects)
      if (object.is_zone()) config.workspace.zones.insert(object.id);
    const auto names = ros2_gateway::message_names(config, arm);
    dds::check_qos_profiles(deployment.network.qos_profiles);
    if (options.check) return runtime::configuration_is_valid("; joints: " + std::to_string(names.size()));
    std::ostringstream urdf;
    if (!cell.arm(config.arm).urdf.empty()) urdf << std::ifstream(cell.arm(config.arm).urdf).rdbuf();
    return ros2_gateway::run_service(deployment, config, arm, urdf.str());
  };
  return runtime::process_main(argc, argv, description);
}
