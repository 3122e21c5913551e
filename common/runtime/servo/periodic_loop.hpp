#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "common/core/clock.hpp"
#include "common/core/health.hpp"
#include "common/core/histogram.hpp"
#include "common/core/progress.hpp"
#include "common/core/snapshot.hpp"
#include "common/core/thread_config.hpp"

namespace phantom::runtime {

/// Scheduling of a loop's thread.
struct LoopScheduling {
  int servo_priority = 0;    ///< SCHED_FIFO priority of a servo, to which the priority of the loop's role is
                             ///< relative (core/thread_place.hpp); 0: ordinary scheduling
  bool lock_memory = false;  ///< mlockall(MCL_CURRENT | MCL_FUTURE)
};

/// Calls a body at a fixed rate at absolute CLOCK_MONOTONIC times, without drift, and keeps statistics.
///
/// A body that overruns, or a host that wakes late, makes the loop *slip*: it skips due times that have
/// passed and does not catch up, so that a servo never runs two steps back to back. The number of ticks and
/// their rate are always current. Statistics over many ticks are published lock-free once a second.
class PeriodicLoop {
 public:
  /// The thread is named after `role`, the statistics are called `name`. The loop counts as hanging if it
  /// does not tick for a second or for twenty periods, whichever is longer. A bare loop, which does nothing,
  /// never counts as hanging.
  PeriodicLoop(std::string name, double period_s, core::ThreadRole role, LoopScheduling scheduling = {});

  /// Runs `body(dt_s)` every period until it returns false or a stop is requested (runtime::stop_requested or
  /// stop()). dt_s is the time since the previous call's due time, a whole multiple of the period. The
  /// calling thread becomes the loop's thread. Apart from the body and the absolute-time sleep, nothing
  /// allocates, locks or blocks.
  void run(const std::function<bool(double dt_s)>& body);
  /// Ends run() after the current tick. Thread-safe.
  void stop() noexcept { stop_.store(true, std::memory_order_relaxed); }

  /// Returns what was refused or unavailable when the thread was set up (e.g. no right to SCHED_FIFO).
  /// Returns an empty string if nothing was, or if the thread is not set up yet. Thread-safe.
  std::string notice() const { return set_up_.load(std::memory_order_acquire) ? notice_ : std::string(); }
  /// Returns the newest statistics. Only one thread may call it.
  core::LoopStatistics statistics();

 private:
  struct Figures {
    double p50_us, p99_us, max_us, work_p50_us, work_max_us;
    std::uint64_t slips;
  };
  void set_up_thread();
  void publish() noexcept;

  double period_s_;
  core::ThreadRole role_;
  LoopScheduling scheduling_;
  std::string notice_;  // constant once set_up_ is true
  std::atomic<bool> set_up_{false};
  std::atomic<bool> stop_{false};
  core::DurationHistogram lateness_, work_;
  core::Progress progress_;
  std::uint64_t slips_ = 0;
  core::Snapshot<Figures> published_;
  Figures latest_{};
};

}  // namespace phantom::runtime
