#include "components/ros2_gateway/dds_adapter_depth.hpp"

#include <algorithm>

#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/publisher.hpp"

namespace phantom::ros2_gateway {

double age_of_image_s(const DepthCameraRules& rules, core::Nanoseconds stamped_utc_ns,
                      core::Nanoseconds utc_ns, core::Nanoseconds since_received_ns) {
  constexpr double kMost_s = 10.0;  // as in the IDL
  const double age_s = rules.topics.largest_stamp_age_s > 0.0
                           ? core::seconds(utc_ns - stamped_utc_ns)
                           : rules.latency_s + core::seconds(since_received_ns);
  return std::clamp(age_s, 0.0, kMost_s);
}

struct DepthCameraInput::Impl {
  Impl(dds::Participant& phantom, ros2::Node& node, const DepthCameraRules& camera_rules)
      : rules(camera_rules),
        writer(phantom, dds::kDepthImage),
        input(
            "images of a depth camera of ROS 2", node, rules.topics,
            {.of_cloud = [this](const CloudMessage& cloud,
                                const Pinhole* camera) { return of_cloud(cloud, camera); },
             .of_image = [this](const ImageMessage& image,
                                const Pinhole& camera) { return depth_image_of(image, camera, rules.range); },
             .publish =
                 [this](messages::DepthImage& image, core::Nanoseconds stamped_utc_ns,
                        core::Nanoseconds received_ns) {
                   image.camera = rules.name;
                   image.age_s = age_of_image_s(rules, stamped_utc_ns, core::utc_ns(),
                                                core::monotonic_ns() - received_ns);
                   return writer.publish(image);
                 }}) {}

  core::Expected<messages::DepthImage> of_cloud(const CloudMessage& cloud, const Pinhole* camera) const {
    if (camera == nullptr) return core::Status::invalid_argument("no camera_info was heard yet");
    return depth_image_of(cloud, *camera, rules.range);
  }

  const DepthCameraRules rules;
  messages::Publisher<messages::DepthImage> writer;
  CloudInput<messages::DepthImage> input;
};

DepthCameraInput::DepthCameraInput(dds::Participant& phantom, ros2::Node& node, const DepthCameraRules& rules)
    : impl_(std::make_unique<Impl>(phantom, node, rules)) {}
DepthCameraInput::~DepthCameraInput() = default;

std::uint64_t DepthCameraInput::handed_on() const { return impl_->input.handed_on(); }
std::uint64_t DepthCameraInput::refused() const { return impl_->input.refused(); }

}  // namespace phantom::ros2_gateway
