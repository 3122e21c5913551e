#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "common/core/status.hpp"
#include "common/messages/teleoperation.hpp"
#include "components/ros2_gateway/sensors/point_clouds.hpp"

namespace phantom::ros2_gateway {

/// A sensor_msgs/msg/CompressedImage as it came; `data` is the message's.
struct CompressedMessage {
  std::string format;
  std::span<const std::uint8_t> data;
};

/// Return a camera's picture as camera_picture has it: width, height and JPEG; name and time are the
/// caller's. Everything is checked before anything is allocated. Errors say what is not as the message's
/// definition has it, or not taken, and what is allowed. Thread-safe.
///
/// Of an Image: rgb8, bgr8 or mono8, of the topic's sizes, whose data hold its rows; encoded with
/// `jpeg_quality` (1…100).
core::Expected<messages::CameraPicture> picture_of(const ImageMessage& image, int jpeg_quality);
/// Of a CompressedImage: JPEG, which is handed on as it is, its first octets alone being looked at, or PNG,
/// which is decoded. What `format` says does not count, but what the data are.
core::Expected<messages::CameraPicture> picture_of(const CompressedMessage& image, int jpeg_quality);

}  // namespace phantom::ros2_gateway
