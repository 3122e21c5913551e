#include <algorithm>

#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/publisher.hpp"
#include "components/ros2_gateway/sensors/dds_adapter_clouds.hpp"

namespace phantom::ros2_gateway {

std::unique_ptr<SensorInput> open_points(dds::Participant& phantom, ros2::Node& node,
                                         const CloudTopics& topics) {
  using Points = messages::SensorPoints;
  const auto writer = std::make_shared<messages::Publisher<Points>>(phantom, dds::kSensorPoints);
  return std::make_unique<CloudInput<Points>>(
      "points of a sensor of ROS 2", node, topics,
      CloudInput<Points>::Ways{
          .of_cloud = [](const CloudMessage& cloud, const Pinhole*) { return points_of(cloud); },
          .of_image = [](const ImageMessage& image,
                         const Pinhole& camera) { return points_of(image, camera); },
          .publish =
              [writer](Points& points, core::Nanoseconds stamped_utc_ns, core::Nanoseconds) {
                points.measured_utc_ns = std::max<core::Nanoseconds>(0, stamped_utc_ns);
                return writer->publish(points);
              }});
}

}  // namespace phantom::ros2_gateway
