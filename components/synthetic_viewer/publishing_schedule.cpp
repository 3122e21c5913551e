#include "components/synthetic_viewer/publishing_schedule.hpp"

#include <algorithm>

namespace phantom::synthetic_viewer {
namespace {

bool take(core::Nanoseconds& due_ns, core::Nanoseconds now_ns, core::Nanoseconds period_ns) {
  if (now_ns < due_ns) return false;
  due_ns = now_ns + period_ns;
  return true;
}

}  // namespace

PublishingSchedule::PublishingSchedule(bool sends_view, double frame_rate_hz) noexcept
    : sends_view_(sends_view),
      oldest_view_ns_(std::max(2 * core::kNsPerSecond, core::from_seconds(2.0 / frame_rate_hz))) {}

PublishingSchedule::Due PublishingSchedule::at(core::Nanoseconds now_ns,
                                               core::Nanoseconds view_made_ns) noexcept {
  const bool current = view_made_ns != 0 && now_ns - view_made_ns < oldest_view_ns_;
  return {sends_view_ && current && take(view_due_ns_, now_ns, kViewPeriod_ns),
          take(status_due_ns_, now_ns, kStatusPeriod_ns)};
}

}  // namespace phantom::synthetic_viewer
