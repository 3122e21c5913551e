#include "components/workspace_camera/camera_watch.hpp"

#include <algorithm>

namespace phantom::workspace_camera {
namespace {

/// FNV-1a by words: a sensor's noise makes each image another one.
std::uint64_t hash_of(std::span<const std::uint16_t> pixels) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;
  for (const std::uint16_t pixel : pixels) hash = (hash ^ pixel) * 0x100000001b3ULL;
  return hash;
}

}  // namespace

bool CameraWatch::put(core::Nanoseconds exposed_ns, std::span<const std::uint16_t> pixels, bool may_repeat) {
  const std::uint64_t hash = hash_of(pixels);
  if (exposed_ns_ != 0 && hash == hash_ && !may_repeat) return false;
  hash_ = hash;
  exposed_ns_ = std::max(exposed_ns_, exposed_ns);
  return true;
}

void CameraWatch::fused(core::Nanoseconds now_ns) { fused_ns_[fused_count_++ % kTimes] = now_ns; }

messages::DepthCameraState CameraWatch::state(core::Nanoseconds now_ns) const {
  using enum messages::DepthCameraState;
  if (exposed_ns_ == 0) return kWaiting;
  const core::Nanoseconds age_ns = now_ns - exposed_ns_;
  return age_ns > dead_ns_ ? kDead : age_ns > late_ns_ ? kLate : kLive;
}

messages::DepthCameraHealth CameraWatch::health(core::Nanoseconds now_ns) const {
  const auto recent = std::ranges::count_if(fused_ns_, [now_ns](core::Nanoseconds at_ns) {
    return at_ns != 0 && now_ns - at_ns < core::kNsPerSecond;
  });
  const double age_s = exposed_ns_ == 0 ? 0.0 : std::max(0.0, core::seconds(now_ns - exposed_ns_));
  return {name_, state(now_ns), age_s, static_cast<double>(recent)};
}

}  // namespace phantom::workspace_camera
