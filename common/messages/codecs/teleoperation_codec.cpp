#include "common/messages/codecs/teleoperation_codec.hpp"

#include <algorithm>
#include <cmath>

#include "common/core/printable.hpp"
#include "common/messages/codecs/fields_codec.hpp"
#include "common/messages/living.hpp"

namespace phantom::messages {
namespace {

#include "phantom_contract/teleoperation_fields.inc"

// Each returns why a sample's fields do not fit together; empty if they do.

std::string pixels_refusal(std::uint32_t width, std::uint32_t height, std::uint64_t most) {
  const std::uint64_t pixels = std::uint64_t{width} * height;
  if (pixels <= most) return "";
  return "width·height is " + std::to_string(pixels) + "; allowed: at most " + std::to_string(most);
}

std::string refusal(const CameraPicture& picture) {
  if (picture.camera.empty()) return "camera is empty; allowed: its name";
  return pixels_refusal(picture.width, picture.height, kMaxPicturePixels);
}

std::string refusal(const SensorPoints& points) {
  const std::string too_many = pixels_refusal(points.width, points.height, kMaxSensorPoints);
  if (!too_many.empty()) return too_many;
  const std::uint64_t count = std::uint64_t{points.width} * points.height;
  if (points.xyz_m.size() != 3 * count)
    return "xyz_m has " + std::to_string(points.xyz_m.size()) + " values; allowed: 3·width·height";
  for (std::size_t i = 0; i < points.xyz_m.size(); i += 3) {
    const float* p = points.xyz_m.data() + i;
    const bool none = std::isnan(p[0]) && std::isnan(p[1]) && std::isnan(p[2]);
    const auto near = [](float x) { return std::abs(x) <= kFarthest_m; };
    if (!none && !std::all_of(p, p + 3, near))
      return "xyz_m has a point that is none or too far; allowed: within 10000 m, or three times NaN";
  }
  return "";
}

std::string refusal(const DepthImage& image) {
  const std::string too_many = pixels_refusal(image.width, image.height, kMaxDepthPixels);
  if (!too_many.empty()) return too_many;
  if (image.max_depth_m <= image.min_depth_m)
    return "max_depth_m is not above min_depth_m; allowed: more than that";
  if (image.depth_mm.size() != std::size_t{image.width} * image.height)
    return "depth_mm has " + std::to_string(image.depth_mm.size()) + " values; allowed: width·height";
  return "";
}

// A stop or a reset is never refused
// for a joint, which it does not use, nor a stop for its issuer, which the log escapes.
std::string refusal(const OperatorCommand& command) {
  using teleop::CommandKind;
  const bool sets_gain =
      command.kind == CommandKind::kSetPerceptGain || command.kind == CommandKind::kSetFeedbackGain;
  if (sets_gain && (command.joint < -1 || command.joint >= static_cast<int>(core::kMaxJoints)))
    return "joint is " + std::to_string(command.joint) + "; allowed: -1 (all) to 15";
  if (command.kind != CommandKind::kEmergencyStop && !core::is_printable(command.issuer))
    return "issuer has control characters; allowed: one line of text";
  return teleop::value_refusal(command.kind, command.value);
}

}  // namespace

#include "phantom_contract/teleoperation_codec.inc"

}  // namespace phantom::messages
