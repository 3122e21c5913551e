#pragma once

#include <algorithm>
#include <cstddef>
#include <deque>
#include <mutex>
#include <optional>
#include <utility>

#include "common/core/clock.hpp"

namespace phantom::synthetic_viewer {

/// The samples of a topic of the last seconds, so that a picture can be drawn for a time that is over. Times
/// are CLOCK_MONOTONIC of this host. Thread-safe; bounded.
template <class Sample>
class Past {
 public:
  static constexpr core::Nanoseconds kKept_ns = 6 * core::kNsPerSecond;
  /// Samples that come closer together are thinned out: between them motion is straight.
  static constexpr core::Nanoseconds kApart_ns = 4 * core::kNsPerMillisecond;

  /// The samples around a time: `before` is not after it, `after` not before it; `share` 0…1 says how far
  /// between them it is.
  struct Around {
    Sample before, after;
    double share = 0.0;
  };

  /// Takes a sample. One whose time is before that of the last is left out.
  void take(const Sample& sample) {
    const std::lock_guard lock(mutex_);
    if (!samples_.empty() && sample.received_ns < samples_.back().received_ns) return;
    // The newest always stands at the end; it gives way as long as the one before it is near.
    if (samples_.size() > 1 && sample.received_ns - samples_[samples_.size() - 2].received_ns < kApart_ns)
      samples_.pop_back();
    samples_.push_back(sample);
    while (samples_.front().received_ns < sample.received_ns - kKept_ns) samples_.pop_front();
  }

  /// Returns the samples around a time; the newest twice if that is older by `hold_ns` at most. Nothing for
  /// times before the first sample, after the last, or within a silence of more than `silence_ns`.
  std::optional<Around> at(core::Nanoseconds time_ns, core::Nanoseconds hold_ns,
                           core::Nanoseconds silence_ns) const {
    const std::lock_guard lock(mutex_);
    const auto after = std::ranges::lower_bound(samples_, time_ns, {}, &Sample::received_ns);
    if (after == samples_.end()) {
      if (samples_.empty() || time_ns - samples_.back().received_ns > hold_ns) return std::nullopt;
      return Around{samples_.back(), samples_.back(), 0.0};
    }
    if (after->received_ns == time_ns) return Around{*after, *after, 0.0};
    if (after == samples_.begin()) return std::nullopt;
    const Sample& before = *std::prev(after);
    const core::Nanoseconds gap_ns = after->received_ns - before.received_ns;
    if (gap_ns > silence_ns) return std::nullopt;
    return Around{before, *after,
                  static_cast<double>(time_ns - before.received_ns) / static_cast<double>(gap_ns)};
  }

 private:
  mutable std::mutex mutex_;
  std::deque<Sample> samples_;
};

}  // namespace phantom::synthetic_viewer
