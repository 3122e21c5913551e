#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstdint>

#include "common/core/clock.hpp"
#include "common/messages/living.hpp"

namespace phantom::phantom_sensing {

/// How long ago depth cameras saw each part of the workspace. Of fixed size, for the real-time loop.
class SeenSpace {
 public:
  SeenSpace() = default;
  /// Takes a sample that is valid. It ages from `received_ns` on.
  SeenSpace(const messages::SpaceView& view, core::Nanoseconds received_ns) noexcept
      : origin_W_m_(view.origin_m),
        cube_m_(view.cube_m),
        size_{view.size_x, view.size_y, view.size_z},
        received_ns_(received_ns) {
    for (std::size_t i = 0; i < std::min(ages_.size(), view.ages.size()); ++i) ages_[i] = view.ages[i];
  }

  /// Returns whether cameras watch the workspace, and have not seen the space around a place within
  /// `max_age_s`. False outside of the workspace, and while no sample has come. Real-time safe: yes.
  bool is_unseen(const Eigen::Vector3d& place_W_m, double max_age_s,
                 core::Nanoseconds now_ns) const noexcept {
    std::size_t at = 0;
    for (std::size_t axis = 3; axis-- > 0;) {
      const double cube = (place_W_m[static_cast<Eigen::Index>(axis)] - origin_W_m_[axis]) / cube_m_;
      if (!(cube >= 0.0 && cube < size_[axis])) return false;
      at = at * size_[axis] + static_cast<std::size_t>(cube);
    }
    if (at >= ages_.size()) return false;
    const std::uint8_t age = ages_[at];
    if (age >= messages::kSpaceAgeMax) return true;
    return messages::kSpaceAgeStep_s * age + core::seconds(now_ns - received_ns_) > max_age_s;
  }

 private:
  std::array<double, 3> origin_W_m_{};
  double cube_m_ = 1.0;
  std::array<std::uint16_t, 3> size_{};  // 0: no sample has come
  core::Nanoseconds received_ns_ = 0;
  std::array<std::uint8_t, messages::kMaxSpaceCubes> ages_{};
};

/// Whether a percept is marked because the space around its place is unseen: at once when it is, and until it
/// has been seen for kHold_ns, so that a place that passes from cube to cube does not make the mark flicker.
class UnseenSpaceWatch {
 public:
  static constexpr core::Nanoseconds kHold_ns = core::kNsPerSecond;
  /// Returns whether the percept is marked. Call it at each tick. Real-time safe: yes.
  bool step(bool unseen, core::Nanoseconds now_ns) noexcept {
    if (unseen) until_ns_ = now_ns + kHold_ns;
    return now_ns < until_ns_;
  }

 private:
  core::Nanoseconds until_ns_ = 0;
};

}  // namespace phantom::phantom_sensing
