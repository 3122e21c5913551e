#pragma once

#include <memory>
#include <string>

#include "common/ros2/node.hpp"

namespace phantom::dds {
class Participant;
}

namespace phantom::ros2_gateway {

/// Which sensor of the ROS 2 domain is heard: a cloud, or depth images with their camera.
struct PointsRules {
  std::string cloud_topic;                     ///< empty: none
  std::string depth_topic, camera_info_topic;  ///< empty: none
  double largest_stamp_age_s = 0.5;            ///< late or early, by this host's clock; 0: not judged
};

/// Hands the points that a sensor measures on as sensor_points. The newest waits for a thread of its own, so
/// that a cloud which takes long to decode does not make other topics wait.
class SensorPointsInput {
 public:
  /// Throws dds::DdsError.
  SensorPointsInput(dds::Participant& phantom, ros2::Node& node, const PointsRules& rules);
  ~SensorPointsInput();

  std::uint64_t handed_on() const;
  std::uint64_t refused() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::ros2_gateway
