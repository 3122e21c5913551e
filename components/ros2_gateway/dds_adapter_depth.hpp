#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "components/ros2_gateway/dds_adapter_clouds.hpp"
#include "components/ros2_gateway/depth_images.hpp"

namespace phantom::dds {
class Participant;
}

namespace phantom::ros2_gateway {

/// Which depth camera of the ROS 2 domain is heard, and how it is called here.
struct DepthCameraRules {
  std::string name;
  CloudTopics topics;  ///< a cloud or depth images, with their camera_info
  DepthRange range;
  /// From the exposure until a message comes, where its stamp is not judged.
  double latency_s = 0.03;
};

/// Returns for how long an image was under way since its exposure, 0 to 10 s: by its stamp and this host's
/// clock, or, where stamps are not judged, by the configured latency and the time since it was received.
double age_of_image_s(const DepthCameraRules& rules, core::Nanoseconds stamped_utc_ns,
                      core::Nanoseconds utc_ns, core::Nanoseconds since_received_ns);

/// Hands the images of a depth camera on as depth_image, on a thread of its own.
class DepthCameraInput {
 public:
  /// Throws dds::DdsError.
  DepthCameraInput(dds::Participant& phantom, ros2::Node& node, const DepthCameraRules& rules);
  ~DepthCameraInput();

  std::uint64_t handed_on() const;
  std::uint64_t refused() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::ros2_gateway
