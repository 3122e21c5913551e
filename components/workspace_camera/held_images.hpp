#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "common/core/clock.hpp"
#include "common/fusion/depth_image.hpp"

namespace phantom::workspace_camera {

/// An image that was measured, perhaps at a time of which the arm's pose is not known yet.
struct ArrivedImage {
  std::size_t camera = 0;  ///< its place in the configuration
  fusion::PinholeCamera pinhole;
  core::Nanoseconds exposed_ns = 0, received_ns = 0;
  std::vector<std::uint16_t> depth_mm;
};

/// Images that wait for the arm's states of their time: of each camera the newest. Pure. One thread.
class HeldImages {
 public:
  /// An image waits no longer than `max_hold_ns`, counted from when its camera's first one began to wait.
  HeldImages(std::size_t cameras, core::Nanoseconds max_hold_ns)
      : max_hold_ns_(max_hold_ns), held_(cameras) {}

  void hold(ArrivedImage image) {
    std::optional<ArrivedImage>& held = held_[image.camera];
    if (held) image.received_ns = held->received_ns;
    held = std::move(image);
  }
  bool any() const {
    return std::ranges::any_of(held_, [](const auto& image) { return image.has_value(); });
  }
  /// Calls take(image) for each that waits no longer. `known_ns`: until when the arm's states are known.
  template <class Take>
  void release(core::Nanoseconds known_ns, core::Nanoseconds now_ns, const Take& take) {
    for (std::optional<ArrivedImage>& held : held_) {
      if (!held || (known_ns < held->exposed_ns && now_ns - held->received_ns < max_hold_ns_)) continue;
      take(*held);
      held.reset();
    }
  }

 private:
  core::Nanoseconds max_hold_ns_;
  std::vector<std::optional<ArrivedImage>> held_;  // by camera
};

}  // namespace phantom::workspace_camera
