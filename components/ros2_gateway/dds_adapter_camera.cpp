#include "components/ros2_gateway/dds_adapter_camera.hpp"

#include <algorithm>
#include <atomic>
#include <optional>

#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/publisher.hpp"
#include "components/ros2_gateway/camera_pictures.hpp"
#include "components/ros2_gateway/sensor_stream.hpp"

namespace phantom::ros2_gateway {
namespace {

namespace sensor = sensor_msgs::msg::dds_;
// Another publisher may take over once the first was silent for so long.
constexpr double kCameraStaleness_s = 1.0;
constexpr double kEarly = 0.9;  // of a period: a camera's own period is not exact
constexpr dds::QosContract kNewestPicture{.reliability = dds::Reliability::kBestEffort, .history_depth = 1};

CompressedMessage message_of(const sensor::CompressedImage_& from) { return {from.format(), from.data()}; }

}  // namespace

struct CameraInput::Impl {
  Impl(dds::Participant& phantom, ros2::Node& node, const CameraRules& camera)
      : rules(camera),
        writer(phantom, dds::kCameraPicture),
        stream("pictures of a camera of ROS 2", kCameraStaleness_s, rules.largest_stamp_age_s) {
    if (!rules.image_topic.empty())
      images.emplace(
          node, rules.image_topic, kNewestPicture,
          [this](const sensor::Image_& message, const dds::SampleInfo& info) { return take(message, info); });
    if (!rules.compressed_topic.empty())
      compressed.emplace(node, rules.compressed_topic, kNewestPicture,
                         [this](const sensor::CompressedImage_& message, const dds::SampleInfo& info) {
                           return take(message, info);
                         });
  }

  template <class Message>
  bool take(const Message& message, const dds::SampleInfo& info) {
    if (!stream.accept(message, info)) return false;
    if (info.received_ns < due_ns) return true;
    stream.put([this, message, at_ns = info.received_ns] { forward(message, at_ns); });
    return true;
  }
  template <class Message>
  void forward(const Message& message, core::Nanoseconds received_ns) {
    auto picture = picture_of(message_of(message), rules.jpeg_quality);
    if (!picture) return void(stream.refuse(picture.status().message()));
    picture->camera = rules.name;
    due_ns = received_ns + core::from_seconds(kEarly / rules.rate_Hz);  // what is refused does not count
    if (rules.largest_stamp_age_s > 0.0)
      picture->exposed_utc_ns =
          std::max<core::Nanoseconds>(0, ros2::nanoseconds_of(message.header().stamp()));
    if (writer.publish(*picture)) stream.count_handed_on();
  }

  const CameraRules rules;
  std::atomic<core::Nanoseconds> due_ns{0};
  messages::Publisher<messages::CameraPicture> writer;
  SensorStream stream;  // ends before what its tasks use
  // Last, so that nothing is heard any more when the rest goes.
  std::optional<ros2::Subscription<sensor::Image_PubSubType>> images;
  std::optional<ros2::Subscription<sensor::CompressedImage_PubSubType>> compressed;
};

CameraInput::CameraInput(dds::Participant& phantom, ros2::Node& node, const CameraRules& rules)
    : impl_(std::make_unique<Impl>(phantom, node, rules)) {}
CameraInput::~CameraInput() = default;

std::uint64_t CameraInput::handed_on() const { return impl_->stream.handed_on(); }
std::uint64_t CameraInput::refused() const { return impl_->stream.refused(); }

}  // namespace phantom::ros2_gateway
