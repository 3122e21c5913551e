#pragma once

#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "common/ros2/node.hpp"
#include "components/ros2_gateway/sensors/dds_adapter_sensors.hpp"
#include "components/ros2_gateway/sensors/sensor_stream.hpp"

namespace phantom::ros2_gateway {

CloudMessage message_of(const sensor_msgs::msg::dds_::PointCloud2_& from);
CameraMessage message_of(const sensor_msgs::msg::dds_::CameraInfo_& from);

/// Hears a sensor's clouds or depth images, makes Output of the newest, and has it published.
template <class Output>
class CloudInput : public SensorInput {
 public:
  struct Ways {
    /// `camera`: null while none was heard.
    std::function<core::Expected<Output>(const CloudMessage&, const Pinhole* camera)> of_cloud;
    std::function<core::Expected<Output>(const ImageMessage&, const Pinhole& camera)> of_image;
    /// Publishes it; returns whether it could. `stamped_utc_ns`: of the message, by its sender's clock;
    /// `received_ns`: monotonic.
    std::function<bool(Output&, core::Nanoseconds stamped_utc_ns, core::Nanoseconds received_ns)> publish;
  };

  /// `what`: in the log. Throws dds::DdsError.
  CloudInput(const char* what, ros2::Node& node, const CloudTopics& topics, Ways ways)
      : ways_(std::move(ways)), stream_(what, kStaleness_s, topics.largest_stamp_age_s) {
    if (!topics.cloud.empty())
      clouds_.emplace(node, topics.cloud, kNewest, [this](const Cloud& message, const dds::SampleInfo& info) {
        return take(message, info);
      });
    if (!topics.camera_info.empty())
      cameras_.emplace(node, topics.camera_info, kNewest,
                       [this](const Camera& message, const dds::SampleInfo&) { return take(message); });
    if (!topics.depth.empty())
      images_.emplace(node, topics.depth, kNewest, [this](const Image& message, const dds::SampleInfo& info) {
        return take(message, info);
      });
  }

  std::uint64_t handed_on() const override { return stream_.handed_on(); }
  std::uint64_t refused() const override { return stream_.refused(); }

 private:
  using Cloud = sensor_msgs::msg::dds_::PointCloud2_;
  using Image = sensor_msgs::msg::dds_::Image_;
  using Camera = sensor_msgs::msg::dds_::CameraInfo_;
  // Clouds come some ten times a second; one that was silent for so long may be another's from then on.
  static constexpr double kStaleness_s = 1.0;
  static constexpr dds::QosContract kNewest{.reliability = dds::Reliability::kBestEffort, .history_depth = 1};

  template <class Message>
  bool take(const Message& message, const dds::SampleInfo& info) {
    if (!stream_.accept(message, info)) return false;
    stream_.put([this, message, at_ns = info.received_ns] { forward(message, at_ns); });
    return true;
  }
  bool take(const Camera& message) {
    const auto pinhole = pinhole_of(message_of(message));
    if (!pinhole) return stream_.refuse("camera_info: " + pinhole.status().message());
    const std::lock_guard lock(mutex_);
    camera_ = *pinhole;
    return true;
  }
  core::Expected<Output> output_of(const Cloud& from, const std::optional<Pinhole>& camera) {
    return ways_.of_cloud(message_of(from), camera ? &*camera : nullptr);
  }
  core::Expected<Output> output_of(const Image& from, const std::optional<Pinhole>& camera) {
    if (!camera) return core::Status::invalid_argument("no camera_info was heard yet");
    return ways_.of_image(message_of(from), *camera);
  }
  template <class Message>
  void forward(const Message& from, core::Nanoseconds received_ns) {
    std::optional<Pinhole> camera;
    {
      const std::lock_guard lock(mutex_);
      camera = camera_;
    }
    auto output = output_of(from, camera);
    if (!output) return void(stream_.refuse(output.status().message()));
    if (ways_.publish(*output, ros2::nanoseconds_of(from.header().stamp()), received_ns))
      stream_.count_handed_on();
  }

  const Ways ways_;
  std::mutex mutex_;  // for the camera
  std::optional<Pinhole> camera_;
  SensorStream stream_;  // ends before what its tasks use
  // Last, so that nothing is heard any more when the rest goes.
  std::optional<ros2::Subscription<sensor_msgs::msg::dds_::PointCloud2_PubSubType>> clouds_;
  std::optional<ros2::Subscription<sensor_msgs::msg::dds_::Image_PubSubType>> images_;
  std::optional<ros2::Subscription<sensor_msgs::msg::dds_::CameraInfo_PubSubType>> cameras_;
};

}  // namespace phantom::ros2_gateway
