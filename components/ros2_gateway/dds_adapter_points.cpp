#include "components/ros2_gateway/dds_adapter_points.hpp"

#include <mutex>
#include <optional>

#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/publisher.hpp"
#include "components/ros2_gateway/point_clouds.hpp"
#include "components/ros2_gateway/sensor_stream.hpp"

namespace phantom::ros2_gateway {
namespace {

namespace sensor = sensor_msgs::msg::dds_;
// Clouds come some ten times a second; one that was silent for so long may be another's from then on.
constexpr double kSensorStaleness_s = 1.0;
constexpr dds::QosContract kNewestPoints{.reliability = dds::Reliability::kBestEffort, .history_depth = 1};

CloudMessage message_of(const sensor::PointCloud2_& from) {
  CloudMessage cloud;
  cloud.frame = from.header().frame_id();
  cloud.height = from.height();
  cloud.width = from.width();
  for (const auto& field : from.fields())
    cloud.fields.push_back({field.name(), field.offset(), field.datatype(), field.count()});
  cloud.big_endian = from.is_bigendian();
  cloud.point_step = from.point_step();
  cloud.row_step = from.row_step();
  cloud.data = from.data();
  return cloud;
}

CameraMessage message_of(const sensor::CameraInfo_& from) {
  const auto& roi = from.roi();
  const bool part = roi.x_offset() != 0 || roi.y_offset() != 0 ||
                    (roi.width() != 0 && roi.width() != from.width()) ||
                    (roi.height() != 0 && roi.height() != from.height());
  return {from.header().frame_id(), from.height(),    from.width(), from.p(),
          from.binning_x(),         from.binning_y(), part};
}

}  // namespace

struct SensorPointsInput::Impl {
  Impl(dds::Participant& phantom, ros2::Node& node, const PointsRules& rules)
      : writer(phantom, dds::kSensorPoints),
        stream("points of a sensor of ROS 2", kSensorStaleness_s, rules.largest_stamp_age_s) {
    if (!rules.cloud_topic.empty())
      clouds.emplace(node, rules.cloud_topic, kNewestPoints,
                     [this](const sensor::PointCloud2_& message, const dds::SampleInfo& info) {
                       return take(message, info);
                     });
    if (rules.depth_topic.empty()) return;
    cameras.emplace(
        node, rules.camera_info_topic, kNewestPoints,
        [this](const sensor::CameraInfo_& message, const dds::SampleInfo&) { return take(message); });
    images.emplace(
        node, rules.depth_topic, kNewestPoints,
        [this](const sensor::Image_& message, const dds::SampleInfo& info) { return take(message, info); });
  }

  template <class Message>
  bool take(const Message& message, const dds::SampleInfo& info) {
    if (!stream.accept(message, info)) return false;
    stream.put([this, message] { forward(points_of(message), message.header()); });
    return true;
  }
  bool take(const sensor::CameraInfo_& message) {
    const auto pinhole = pinhole_of(message_of(message));
    if (!pinhole) return stream.refuse("camera_info: " + pinhole.status().message());
    const std::lock_guard lock(mutex);
    camera = *pinhole;
    return true;
  }

  core::Expected<messages::SensorPoints> points_of(const sensor::PointCloud2_& from) {
    return ros2_gateway::points_of(message_of(from));
  }
  core::Expected<messages::SensorPoints> points_of(const sensor::Image_& from) {
    std::optional<Pinhole> its_camera;
    {
      const std::lock_guard lock(mutex);
      its_camera = camera;
    }
    if (!its_camera) return core::Status::invalid_argument("no camera_info was heard yet");
    return ros2_gateway::points_of(message_of(from), *its_camera);
  }

  void forward(core::Expected<messages::SensorPoints> points, const std_msgs::msg::dds_::Header_& from) {
    if (!points) return void(stream.refuse(points.status().message()));
    points->measured_utc_ns = std::max<core::Nanoseconds>(0, ros2::nanoseconds_of(from.stamp()));
    if (writer.publish(*points)) stream.count_handed_on();
  }

  std::mutex mutex;  // for the camera
  std::optional<Pinhole> camera;
  messages::Publisher<messages::SensorPoints> writer;
  SensorStream stream;  // ends before what its tasks use
  // Last, so that nothing is heard any more when the rest goes.
  std::optional<ros2::Subscription<sensor::PointCloud2_PubSubType>> clouds;
  std::optional<ros2::Subscription<sensor::Image_PubSubType>> images;
  std::optional<ros2::Subscription<sensor::CameraInfo_PubSubType>> cameras;
};

SensorPointsInput::SensorPointsInput(dds::Participant& phantom, ros2::Node& node, const PointsRules& rules)
    : impl_(std::make_unique<Impl>(phantom, node, rules)) {}
SensorPointsInput::~SensorPointsInput() = default;

std::uint64_t SensorPointsInput::handed_on() const { return impl_->stream.handed_on(); }
std::uint64_t SensorPointsInput::refused() const { return impl_->stream.refused(); }

}  // namespace phantom::ros2_gateway
