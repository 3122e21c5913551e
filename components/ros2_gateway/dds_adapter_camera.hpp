#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "common/ros2/node.hpp"

namespace phantom::dds {
class Participant;
}

namespace phantom::ros2_gateway {

/// Which camera of the ROS 2 domain is heard, and how it is called here.
struct CameraRules {
  std::string image_topic, compressed_topic;  ///< one of them at most; empty: none
  std::string name = "camera";
  double rate_Hz = 15.0;  ///< handed on at most
  int jpeg_quality = 90;
  double largest_stamp_age_s = 0.5;  ///< late or early, by this host's clock; 0: not judged, not handed on

  bool wanted() const { return !image_topic.empty() || !compressed_topic.empty(); }
};

/// Hands the pictures of a camera on as camera_picture, encoded on a thread of its own.
class CameraInput {
 public:
  /// Throws dds::DdsError.
  CameraInput(dds::Participant& phantom, ros2::Node& node, const CameraRules& rules);
  ~CameraInput();

  std::uint64_t handed_on() const;
  std::uint64_t refused() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace phantom::ros2_gateway
