#pragma once

#include <cstdint>
#include <memory>

#include "components/ros2_gateway/dds_adapter_clouds.hpp"

namespace phantom::dds {
class Participant;
}

namespace phantom::ros2_gateway {

/// Hands the points that a sensor measures on as sensor_points. The newest waits for a thread of its own, so
/// that a cloud which takes long to decode does not make other topics wait.
class SensorPointsInput {
 public:
  /// Throws dds::DdsError.
  SensorPointsInput(dds::Participant& phantom, ros2::Node& node, const CloudTopics& topics);
  ~SensorPointsInput();

  std::uint64_t handed_on() const;
  std::uint64_t refused() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::ros2_gateway
