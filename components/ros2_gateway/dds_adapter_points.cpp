#include "components/ros2_gateway/dds_adapter_points.hpp"

#include <algorithm>

#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/publisher.hpp"

namespace phantom::ros2_gateway {

struct SensorPointsInput::Impl {
  Impl(dds::Participant& phantom, ros2::Node& node, const CloudTopics& topics)
      : writer(phantom, dds::kSensorPoints),
        input(
            "points of a sensor of ROS 2", node, topics,
            {.of_cloud = [](const CloudMessage& cloud, const Pinhole*) { return points_of(cloud); },
             .of_image = [](const ImageMessage& image,
                            const Pinhole& camera) { return points_of(image, camera); },
             .publish =
                 [this](messages::SensorPoints& points, core::Nanoseconds stamped_utc_ns, core::Nanoseconds) {
                   points.measured_utc_ns = std::max<core::Nanoseconds>(0, stamped_utc_ns);
                   return writer.publish(points);
                 }}) {}

  messages::Publisher<messages::SensorPoints> writer;
  CloudInput<messages::SensorPoints> input;
};

SensorPointsInput::SensorPointsInput(dds::Participant& phantom, ros2::Node& node, const CloudTopics& topics)
    : impl_(std::make_unique<Impl>(phantom, node, topics)) {}
SensorPointsInput::~SensorPointsInput() = default;

std::uint64_t SensorPointsInput::handed_on() const { return impl_->input.handed_on(); }
std::uint64_t SensorPointsInput::refused() const { return impl_->input.refused(); }

}  // namespace phantom::ros2_gateway
