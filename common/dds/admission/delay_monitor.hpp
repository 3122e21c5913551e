#pragma once

#include <atomic>
#include <optional>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/stamp.hpp"

namespace phantom::dds {

/// Tells samples that were held up on their way: by a network's queue, or in the buffers of a process that
/// stood still and runs again. It compares the sample's age by the monotonic clocks of writer and reader,
/// which differ by an unknown constant, with the least that was seen of the same run of the writer. So wall
/// clocks have no part in it. It also measures by how much the wall clocks of both hosts differ. One thread
/// calls is_late(); clock_difference_s() is thread-safe. Both are real-time safe.
class DelayMonitor {
 public:
  /// A sample is late when it was on its way for this much longer than the quickest.
  static constexpr core::Nanoseconds kLate_ns = core::kNsPerSecond;
  /// Two monotonic clocks drift apart by less than this, as a ratio; the quickest counts as slower at that
  /// rate.
  static constexpr double kDrift = 1e-3;
  /// A sample that would be older than none before it, by more than kLate_ns, is believed once so many came
  /// in a row: no single number can make all that follow late.
  static constexpr int kRun = 8;
  /// Once every sample was late for this time, the way is believed to be as slow as that now. The writer's
  /// host may have been suspended, which stops its monotonic clock.
  static constexpr core::Nanoseconds kForget_ns = 30 * core::kNsPerSecond;
  /// Samples that were on their way for this much longer than the quickest do not measure clocks.
  static constexpr core::Nanoseconds kPrompt_ns = 50 * core::kNsPerMillisecond;

  DelayMonitor() = default;
  /// A copy goes on by itself. The one that is copied must not be in use meanwhile.
  DelayMonitor(const DelayMonitor& other) noexcept { *this = other; }
  DelayMonitor& operator=(const DelayMonitor& other) noexcept;
  ~DelayMonitor() = default;

  /// Returns whether a sample of the followed writer was held up. `received_ns`, `received_utc_ns`: when it
  /// was received, by this host's monotonic and wall clock. A stamp without a time is never late.
  bool is_late(const msg::Stamp& stamp, core::Nanoseconds received_ns,
               core::Nanoseconds received_utc_ns) noexcept;
  /// Returns by how many seconds this host's wall clock is ahead of the writer's, the quickest delay of the
  /// way included; nothing before the first sample.
  std::optional<double> clock_difference_s() const noexcept;

 private:
  void restart(std::uint64_t session, core::Nanoseconds age_ns, core::Nanoseconds received_ns) noexcept;

  static constexpr core::Nanoseconds kUnknown = INT64_MIN;
  std::uint64_t session_ = 0;
  core::Nanoseconds quickest_ns_ = 0;  // least age, the constant of the two clocks included
  core::Nanoseconds updated_ns_ = 0;   // when that was last raised by the drift
  core::Nanoseconds punctual_ns_ = 0;  // when a sample was last not late; 0: none yet
  int early_ = 0;                      // samples in a row that came before any could
  std::atomic<core::Nanoseconds> difference_ns_{kUnknown};
};

}  // namespace phantom::dds
