#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "common/core/clock.hpp"
#include "common/messages/living.hpp"

namespace phantom::workspace_camera {

/// Watches one camera: whether its images come, how old they are, and whether they are the same again and
/// again, as those of a camera that hangs are. Pure. One thread.
class CameraWatch {
 public:
  CameraWatch(std::string name, double late_s, double dead_s)
      : name_(std::move(name)), late_ns_(core::from_seconds(late_s)), dead_ns_(core::from_seconds(dead_s)) {}

  /// Notes an image. Returns false if it is the same as the one before: there is nothing new in it.
  /// `may_repeat`: what is played from files may be the same.
  bool put(core::Nanoseconds exposed_ns, std::span<const std::uint16_t> pixels, bool may_repeat = false);
  /// Notes that the image was fused.
  void fused(core::Nanoseconds now_ns);

  messages::DepthCameraState state(core::Nanoseconds now_ns) const;
  messages::DepthCameraHealth health(core::Nanoseconds now_ns) const;

 private:
  static constexpr std::size_t kTimes = 128;  // more than come in a second
  std::string name_;
  core::Nanoseconds late_ns_, dead_ns_;
  core::Nanoseconds exposed_ns_ = 0;  // of the newest image that was not the same as before; 0: none
  std::uint64_t hash_ = 0;
  std::array<core::Nanoseconds, kTimes> fused_ns_{};
  std::size_t fused_count_ = 0;
};

}  // namespace phantom::workspace_camera
