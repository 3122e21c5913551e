#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/robot/kinematics/serial_arm.hpp"
#include "common/ros2/node.hpp"
#include "components/ros2_gateway/dds_adapter_master.hpp"
#include "components/ros2_gateway/dds_adapter_out.hpp"
#include "components/ros2_gateway/dds_adapter_workspace.hpp"
#include "components/ros2_gateway/joint_states.hpp"
#include "components/ros2_gateway/sensors/sensor_rules.hpp"

namespace phantom::ros2_gateway {

/// Text of ros2_gateway.yaml: the shipped parameters and the table of all.
extern const char* const kParameters;

struct GatewayConfig {
  std::filesystem::path file;  ///< for messages
  std::string arm;             ///< of the cell; empty: the only one
  ros2::NodeOptions node;
  std::string joint_states_topic = "joint_states";  ///< empty: none is heard
  std::vector<std::string> joint_names;             ///< of the arm's joints in messages; empty: their own
  JointStatesRules joint_states;
  std::string wrench_topic, wrench_frame;                    ///< no topic: none is heard; no frame: any
  std::string collision_objects_topic = "collision_object";  ///< empty: none come in
  MasterRules master;
  CloudTopics points;
  std::vector<DepthCameraRules> depth_cameras;
  CameraRules camera;
  OutputRules out;
  WorkspaceRules workspace;
};

/// Throws core::ConfigError, and core::MissingError if the file cannot be read.
GatewayConfig load_config(const std::filesystem::path& path);

/// Returns the name in messages of each joint of the arm. Throws core::ConfigError if the configuration
/// has another number of names, or one twice.
std::vector<std::string> message_names(const GatewayConfig& config, const robot::SerialArm& arm);

}  // namespace phantom::ros2_gateway
