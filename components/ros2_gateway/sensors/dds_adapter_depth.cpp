#include <algorithm>

#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/publisher.hpp"
#include "components/ros2_gateway/sensors/dds_adapter_clouds.hpp"

namespace phantom::ros2_gateway {

double age_of_image_s(const DepthCameraRules& rules, core::Nanoseconds stamped_utc_ns,
                      core::Nanoseconds utc_ns, core::Nanoseconds since_received_ns) {
  constexpr double kMost_s = 10.0;  // as in the IDL
  const double age_s = rules.topics.largest_stamp_age_s > 0.0
                           ? core::seconds(utc_ns - stamped_utc_ns)
                           : rules.latency_s + core::seconds(since_received_ns);
  return std::clamp(age_s, 0.0, kMost_s);
}

std::unique_ptr<SensorInput> open_depth_camera(dds::Participant& phantom, ros2::Node& node,
                                               const DepthCameraRules& rules) {
  using Image = messages::DepthImage;
  const auto writer = std::make_shared<messages::Publisher<Image>>(phantom, dds::kDepthImage);
  return std::make_unique<CloudInput<Image>>(
      "images of a depth camera of ROS 2", node, rules.topics,
      CloudInput<Image>::Ways{
          .of_cloud = [rules](const CloudMessage& cloud, const Pinhole* camera) -> core::Expected<Image> {
            if (camera == nullptr) return core::Status::invalid_argument("no camera_info was heard yet");
            return depth_image_of(cloud, *camera, rules.range);
          },
          .of_image = [rules](const ImageMessage& image,
                              const Pinhole& camera) { return depth_image_of(image, camera, rules.range); },
          .publish =
              [rules, writer](Image& image, core::Nanoseconds stamped_utc_ns, core::Nanoseconds received_ns) {
                image.camera = rules.name;
                image.age_s =
                    age_of_image_s(rules, stamped_utc_ns, core::utc_ns(), core::monotonic_ns() - received_ns);
                return writer->publish(image);
              }});
}

}  // namespace phantom::ros2_gateway
