#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

#include "common/core/clock.hpp"
#include "common/core/health.hpp"

namespace phantom::core {

/// A loop's or serving thread's own account of how it gets on: the thread ticks once a turn, and anybody may
/// read its rate of the last second and for how long it has not ticked. A thread that hangs, or that the host
/// does not let run, thus shows by itself, and no other thread can speak for it.
///
/// One thread ticks; any number may read. Real-time safe: begin(), tick(), rest() and end().
class Progress {
 public:
  /// A thread that has not ticked for so long hangs. Far above what a loaded host makes a thread wait, below
  /// the time after which the service manager ends the process (WatchdogSec).
  static constexpr double kHangsAfter_s = 1.0;

  /// `name`: as component_status shows it. `period_s`: nominal, 0 if the thread has none. `limit_s`: it hangs
  /// after so long without a tick; 0: never.
  explicit Progress(std::string name, double period_s = 0.0, double limit_s = kHangsAfter_s);

  /// The thread runs from now on: before its first tick.
  void begin(Nanoseconds now_ns = monotonic_ns()) noexcept;
  /// A turn is done.
  void tick(Nanoseconds now_ns = monotonic_ns()) noexcept;
  /// The thread now waits for something that may take any time; until its next tick it cannot hang.
  void rest() noexcept { last_ns_.store(kResting, std::memory_order_relaxed); }
  /// The thread ends in order.
  void end(Nanoseconds now_ns = monotonic_ns()) noexcept { ended_ns_.store(now_ns); }

  const std::string& name() const noexcept { return name_; }
  /// Name, period, rate, ticks, idle_s and limit_s at `now_ns`; of a thread that has ended, at its end. The
  /// rate is that of the last whole second, or of the time since begin() where that is shorter.
  LoopStatistics statistics(Nanoseconds now_ns = monotonic_ns()) const;

 private:
  static constexpr Nanoseconds kSlot_ns = kNsPerSecond / 10, kResting = -1;
  static constexpr std::uint64_t kSlots = 16, kWindow = 10;  // slots kept; slots of a second
  static constexpr unsigned kCountBits = 24;
  double rate_hz(Nanoseconds now_ns) const noexcept;

  std::string name_;
  double period_s_, limit_s_;
  std::atomic<Nanoseconds> begun_ns_{0}, last_ns_{0}, ended_ns_{0};
  std::atomic<std::uint64_t> ticks_{0};
  std::array<std::atomic<std::uint64_t>, kSlots> slots_{};  // number of the slot << kCountBits | ticks in it
};

}  // namespace phantom::core
