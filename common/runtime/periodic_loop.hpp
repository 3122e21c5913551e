#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "common/core/clock.hpp"
#include "common/core/health.hpp"
#include "common/core/histogram.hpp"
#include "common/core/progress.hpp"
#include "common/core/snapshot.hpp"
#include "common/core/thread_place.hpp"

namespace phantom::runtime {

/// How a loop's thread asks to be scheduled.
struct LoopScheduling {
  int servo_priority = 0;    ///< SCHED_FIFO priority of a servo, to which the loop's role is relative
                             ///< (core/thread_place.hpp); 0: ordinary scheduling
  bool lock_memory = false;  ///< mlockall(MCL_CURRENT | MCL_FUTURE)
};

/// Calls a body at a fixed rate on absolute CLOCK_MONOTONIC times, without drift, and keeps count.
///
/// A body that overruns, or a host that wakes late, makes the loop *slip*: due times that have passed are
/// skipped, not caught up, so that a servo never runs two steps back to back. Ticks and their rate are read
/// as they are now; what is taken over many ticks is published lock-free once a second.
class PeriodicLoop {
 public:
  /// The thread's name is that of `role`, the statistics' is `name`. It hangs if it does not tick for a
  /// second or, where that is longer, twenty periods; a bare loop, which does nothing, never does.
  PeriodicLoop(std::string name, double period_s, core::ThreadRole role, LoopScheduling scheduling = {});

  /// Runs `body(dt_s)` every period until it returns false or a stop is requested (runtime::stop_requested or
  /// stop()). dt_s is the time since the previous call's due time: a whole multiple of the period. The thread
  /// that calls run() becomes the loop's. Nothing but the body can allocate, lock or block besides the
  /// absolute-time sleep.
  void run(const std::function<bool(double dt_s)>& body);
  /// Ends run() after the current tick. Thread-safe.
  void stop() noexcept { stop_.store(true, std::memory_order_relaxed); }

  /// What was refused or unavailable when the thread was set up (e.g. no right to SCHED_FIFO); empty if
  /// nothing, or not set up yet. Thread-safe.
  std::string notice() const { return set_up_.load(std::memory_order_acquire) ? notice_ : std::string(); }
  /// Newest statistics. One reader thread.
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
  std::string notice_;  // once set_up_ is true it stays as it is
  std::atomic<bool> set_up_{false};
  std::atomic<bool> stop_{false};
  core::DurationHistogram lateness_, work_;
  core::Progress progress_;
  std::uint64_t slips_ = 0;
  core::Snapshot<Figures> published_;
  Figures latest_{};
};

}  // namespace phantom::runtime
