#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/core/health.hpp"
#include "common/core/network.hpp"
#include "common/messages/teleoperation.hpp"
#include "components/ros2_gateway/config.hpp"
#include "components/ros2_gateway/joint_states.hpp"

namespace phantom::ros2_gateway {

/// Both sides of the gateway: a participant of the ROS 2 domain, and one of Phantom's own. The robot's
/// joint_states become slave_state; what Outputs says in ROS 2's words comes of Phantom's topics.
class DdsAdapter {
 public:
  /// What is done with a JointState: returns whether `state` is to be published; the reason if it is refused.
  using OnJointStates = std::function<core::Expected<bool>(const JointStateMessage&, messages::SlaveState&)>;

  /// Throws dds::DdsError, and core::MissingError if an interface is missing. `on_joint_states` runs on a
  /// middleware thread.
  DdsAdapter(const core::NetworkOptions& network, const GatewayConfig& config, const robot::SerialArm& arm,
             const std::string& urdf, OnJointStates on_joint_states);
  ~DdsAdapter();

  /// Returns how many publishers of joint_states are there.
  std::uint32_t robots() const;
  /// Publishes in the ROS 2 domain what is new (Outputs::publish). One thread.
  void publish(bool diagnostics);
  /// Publishes component_status. One thread.
  void report(core::Health health);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::ros2_gateway
