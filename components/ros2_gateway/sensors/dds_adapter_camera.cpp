#include <algorithm>
#include <atomic>
#include <optional>

#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/publisher.hpp"
#include "components/ros2_gateway/sensors/camera_pictures.hpp"
#include "components/ros2_gateway/sensors/dds_adapter_sensors.hpp"
#include "components/ros2_gateway/sensors/sensor_stream.hpp"

namespace phantom::ros2_gateway {
namespace {

namespace sensor = sensor_msgs::msg::dds_;
// Another publisher may take over once the first was silent for so long.
constexpr double kCameraStaleness_s = 1.0;
constexpr double kEarly = 0.9;  // of a period: a camera's own period is not exact
constexpr dds::QosContract kNewestPicture{.reliability = dds::Reliability::kBestEffort, .history_depth = 1};

using ros2_gateway::message_of;
CompressedMessage message_of(const sensor::CompressedImage_& from) { return {from.format(), from.data()}; }

class CameraInput : public SensorInput {
 public:
  CameraInput(dds::Participant& phantom, ros2::Node& node, const CameraRules& rules)
      : rules_(rules),
        writer_(phantom, dds::kCameraPicture),
        stream_("pictures of a camera of ROS 2", kCameraStaleness_s, rules_.largest_stamp_age_s) {
    if (!rules_.image_topic.empty())
      images_.emplace(
          node, rules_.image_topic, kNewestPicture,
          [this](const sensor::Image_& message, const dds::SampleInfo& info) { return take(message, info); });
    if (!rules_.compressed_topic.empty())
      compressed_.emplace(node, rules_.compressed_topic, kNewestPicture,
                          [this](const sensor::CompressedImage_& message, const dds::SampleInfo& info) {
                            return take(message, info);
                          });
  }

  std::uint64_t handed_on() const override { return stream_.handed_on(); }
  std::uint64_t refused() const override { return stream_.refused(); }

 private:
  template <class Message>
  bool take(const Message& message, const dds::SampleInfo& info) {
    if (!stream_.accept(message, info)) return false;
    if (info.received_ns < due_ns_) return true;
    stream_.put([this, message, at_ns = info.received_ns] { forward(message, at_ns); });
    return true;
  }
  template <class Message>
  void forward(const Message& message, core::Nanoseconds received_ns) {
    auto picture = picture_of(message_of(message), rules_.jpeg_quality);
    if (!picture) return void(stream_.refuse(picture.status().message()));
    picture->camera = rules_.name;
    due_ns_ = received_ns + core::from_seconds(kEarly / rules_.rate_Hz);  // what is refused does not count
    if (rules_.largest_stamp_age_s > 0.0)
      picture->exposed_utc_ns =
          std::max<core::Nanoseconds>(0, ros2::nanoseconds_of(message.header().stamp()));
    if (writer_.publish(*picture)) stream_.count_handed_on();
  }

  const CameraRules rules_;
  std::atomic<core::Nanoseconds> due_ns_{0};
  messages::Publisher<messages::CameraPicture> writer_;
  SensorStream stream_;  // ends before what its tasks use
  // Last, so that nothing is heard any more when the rest goes.
  std::optional<ros2::Subscription<sensor::Image_PubSubType>> images_;
  std::optional<ros2::Subscription<sensor::CompressedImage_PubSubType>> compressed_;
};

}  // namespace

std::unique_ptr<SensorInput> open_camera(dds::Participant& phantom, ros2::Node& node,
                                         const CameraRules& rules) {
  return std::make_unique<CameraInput>(phantom, node, rules);
}

}  // namespace phantom::ros2_gateway
