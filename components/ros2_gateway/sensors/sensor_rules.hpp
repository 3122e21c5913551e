#pragma once

#include <string>

#include "components/ros2_gateway/sensors/depth_images.hpp"

namespace phantom::ros2_gateway {

/// The topics by which a sensor's clouds or depth images come; empty: none.
struct CloudTopics {
  std::string cloud, depth, camera_info;
  double largest_stamp_age_s = 0.5;  ///< late or early, by this host's clock; 0: not judged
};

/// Which depth camera of the ROS 2 domain is heard, and how it is called here.
struct DepthCameraRules {
  std::string name;
  CloudTopics topics;  ///< a cloud or depth images, with their camera_info
  DepthRange range;
  /// From the exposure until a message comes, where its stamp is not judged.
  double latency_s = 0.03;
};

/// Which camera of the ROS 2 domain is heard, and how it is called here.
struct CameraRules {
  std::string image_topic, compressed_topic;  ///< one of them at most; empty: none
  std::string name = "camera";
  double rate_Hz = 15.0;  ///< handed on at most
  int jpeg_quality = 90;
  double largest_stamp_age_s = 0.5;  ///< late or early, by this host's clock; 0: not judged, not handed on

  bool wanted() const { return !image_topic.empty() || !compressed_topic.empty(); }
};

/// Returns for how long an image was under way since its exposure, 0 to 10 s: by its stamp and this host's
/// clock, or, where stamps are not judged, by the configured latency and the time since it was received.
double age_of_image_s(const DepthCameraRules& rules, core::Nanoseconds stamped_utc_ns,
                      core::Nanoseconds utc_ns, core::Nanoseconds since_received_ns);

}  // namespace phantom::ros2_gateway
