#pragma once

#include <algorithm>

#include "common/core/clock.hpp"

namespace phantom::synthetic_viewer {

/// Decides when the viewer publishes its view pose and its status: at most at the promised rates, however
/// often it is asked, and never a view that is too old. It reads no clock; a missed time is not made up for.
class PublishingSchedule {
 public:
  static constexpr core::Nanoseconds kViewPeriod_ns = core::kNsPerSecond / 10;
  static constexpr core::Nanoseconds kStatusPeriod_ns = core::kNsPerSecond / 2;

  struct Due {
    bool view_pose = false, status = false;
  };

  /// `sends_view`: false for a viewer that only shows, which must not turn the listener. A view is published
  /// until 2 s after it was drawn or, at low frame rates, until two frame periods after it. If no newer one
  /// has come by then, the viewer hangs or is overloaded.
  PublishingSchedule(bool sends_view, double frame_rate_hz) noexcept
      : sends_view_(sends_view),
        oldest_view_ns_(std::max(2 * core::kNsPerSecond, core::from_seconds(2.0 / frame_rate_hz))) {}

  /// Returns what is to be published now. `view_made_ns`: when the view was drawn, 0 if none was yet. Times
  /// are of CLOCK_MONOTONIC and do not go back.
  Due at(core::Nanoseconds now_ns, core::Nanoseconds view_made_ns) noexcept {
    const bool current = view_made_ns != 0 && now_ns - view_made_ns < oldest_view_ns_;
    const auto take = [now_ns](core::Nanoseconds& due_ns, core::Nanoseconds period_ns) {
      const bool due = now_ns >= due_ns;
      if (due) due_ns = now_ns + period_ns;
      return due;
    };
    return {sends_view_ && current && take(view_due_ns_, kViewPeriod_ns),
            take(status_due_ns_, kStatusPeriod_ns)};
  }

 private:
  bool sends_view_;
  core::Nanoseconds oldest_view_ns_;
  core::Nanoseconds view_due_ns_ = 0, status_due_ns_ = 0;
};

}  // namespace phantom::synthetic_viewer
