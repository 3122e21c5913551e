#pragma once

#include <cstdint>
#include <memory>

#include "common/ros2/node.hpp"
#include "components/ros2_gateway/sensors/sensor_rules.hpp"

namespace phantom::dds {
class Participant;
}

namespace phantom::ros2_gateway {

/// Hears a sensor of the ROS 2 domain and hands what it measures on. The newest message waits for a thread of
/// its own, so that one which takes long to decode does not make other topics wait. Any thread.
class SensorInput {
 public:
  SensorInput() = default;
  virtual ~SensorInput() = default;
  SensorInput(const SensorInput&) = delete;
  SensorInput& operator=(const SensorInput&) = delete;

  virtual std::uint64_t handed_on() const = 0;
  virtual std::uint64_t refused() const = 0;
};

// These hear a sensor until what they return is destroyed, and throw dds::DdsError. `phantom` and `node` must
// outlive that.

/// Points of a sensor, as sensor_points.
std::unique_ptr<SensorInput> open_points(dds::Participant& phantom, ros2::Node& node,
                                         const CloudTopics& topics);
/// Images of a depth camera, as depth_image.
std::unique_ptr<SensorInput> open_depth_camera(dds::Participant& phantom, ros2::Node& node,
                                               const DepthCameraRules& rules);
/// Pictures of a camera, as camera_picture.
std::unique_ptr<SensorInput> open_camera(dds::Participant& phantom, ros2::Node& node,
                                         const CameraRules& rules);

}  // namespace phantom::ros2_gateway
