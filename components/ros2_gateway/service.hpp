#pragma once

#include "common/robot/kinematics/serial_arm.hpp"
#include "common/runtime/configuration/deployment.hpp"
#include "components/ros2_gateway/config.hpp"

namespace phantom::ros2_gateway {

/// Runs the gateway until a stop is requested. `urdf`: text of the arm's description; may be empty. Throws
/// dds::DdsError, core::ConfigError, core::MissingError.
int run_service(const runtime::Deployment& deployment, const GatewayConfig& config,
                const robot::SerialArm& arm, const std::string& urdf);

}  // namespace phantom::ros2_gateway
