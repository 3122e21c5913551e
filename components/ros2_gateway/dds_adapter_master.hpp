#pragma once

#include <memory>
#include <string>

#include "common/ros2/node.hpp"
#include "components/ros2_gateway/twist_master.hpp"

namespace phantom::dds {
class Participant;
}

namespace phantom::ros2_gateway {

/// Who of the ROS 2 domain is the master.
struct MasterRules {
  std::string twist_topic, joy_topic;  ///< one of them, or none
  std::string frame;                   ///< frame_id of the messages that are taken; empty: any
  TwistMasterRules handle;
};

/// Serves a haptic device (docs/haptic_device.md) that TwistStamped or Joy of the ROS 2 domain move, in a
/// thread of its own.
class MasterInput {
 public:
  /// Throws dds::DdsError.
  MasterInput(dds::Participant& phantom, ros2::Node& node, const MasterRules& rules);
  ~MasterInput();

  std::uint64_t heard() const;
  std::uint64_t refused() const;
  /// Returns what the operator is to know: who leads, or why nothing does.
  std::string sentence() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::ros2_gateway
