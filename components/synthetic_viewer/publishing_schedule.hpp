#pragma once

#include "common/core/clock.hpp"

namespace phantom::synthetic_viewer {

/// When the viewer tells others how its view stands and how it is itself: not more often than it promises,
/// however often it is asked, and nothing that is too old. Knows no clock; a late question is not made up
/// for.
class PublishingSchedule {
 public:
  static constexpr core::Nanoseconds kViewPeriod_ns = core::kNsPerSecond / 10;
  static constexpr core::Nanoseconds kStatusPeriod_ns = core::kNsPerSecond / 2;

  struct Due {
    bool view_pose = false, status = false;
  };

  /// `sends_view`: an onlooker's viewer turns nobody's ears. A view counts until 2 s after it was drawn, or
  /// until the second picture after it is overdue where pictures are as rare as that: then the viewer hangs,
  /// or has far too much to do.
  PublishingSchedule(bool sends_view, double frame_rate_hz) noexcept;

  /// What is to be published now. `view_made_ns`: when the view was drawn, 0 if none was yet. Times are of
  /// CLOCK_MONOTONIC and do not go back.
  Due at(core::Nanoseconds now_ns, core::Nanoseconds view_made_ns) noexcept;

 private:
  bool sends_view_;
  core::Nanoseconds oldest_view_ns_;
  core::Nanoseconds view_due_ns_ = 0, status_due_ns_ = 0;
};

}  // namespace phantom::synthetic_viewer
