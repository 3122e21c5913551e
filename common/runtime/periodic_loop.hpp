#pragma once

#include <atomic>
#include <functional>
#include <string>

#include "common/core/clock.hpp"
#include "common/core/health.hpp"
#include "common/core/histogram.hpp"
#include "common/core/snapshot.hpp"

namespace phantom::runtime {

/// How a loop's thread asks to be scheduled.
struct LoopScheduling {
  int fifo_priority = 0;     ///< SCHED_FIFO priority 1…99; 0: leave the scheduler alone
  bool lock_memory = false;  ///< mlockall(MCL_CURRENT | MCL_FUTURE)
};

/// Calls a body at a fixed rate on absolute CLOCK_MONOTONIC times, without drift, and keeps count.
///
/// A body that overruns, or a host that wakes late, makes the loop *slip*: due times that have passed are
/// skipped, not caught up, so that a servo never runs two steps back to back. Statistics are published
/// lock-free once a second.
class PeriodicLoop {
 public:
  PeriodicLoop(std::string name, double period_s, LoopScheduling scheduling = {});

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
    double elapsed_s, p50_us, p99_us, max_us, work_p50_us, work_max_us;
    std::uint64_t ticks, slips;
  };
  void set_up_thread();
  void publish(core::Nanoseconds start_ns) noexcept;

  std::string name_;
  double period_s_;
  LoopScheduling scheduling_;
  std::string notice_;  // once set_up_ is true it stays as it is
  std::atomic<bool> set_up_{false};
  std::atomic<bool> stop_{false};
  core::DurationHistogram lateness_, work_;
  std::uint64_t ticks_ = 0, slips_ = 0;
  core::Snapshot<Figures> published_;
  Figures latest_{};
};

}  // namespace phantom::runtime
