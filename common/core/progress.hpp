#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <string>

#include "common/core/clock.hpp"
#include "common/core/health.hpp"

namespace phantom::core {

/// Records the progress of one loop or serving thread. The thread ticks once per turn; any thread may read
/// its rate over the last second and the time since its last tick. A thread that hangs, or that the host does
/// not schedule, thus shows, and no other thread can report progress for it.
///
/// One thread ticks; any number may read. Real-time safe: begin(), tick(), rest() and end().
class Progress {
 public:
  /// A thread that has not ticked for this long hangs. The limit is far above what a loaded host makes a
  /// thread wait, and below the time after which the service manager ends the process (WatchdogSec).
  static constexpr double kHangsAfter_s = 1.0;

  /// `name`: as component_status shows it. `period_s`: nominal, 0 if the thread has none. `limit_s`: time
  /// without a tick after which the thread hangs; 0: it never does.
  explicit Progress(std::string name, double period_s = 0.0, double limit_s = kHangsAfter_s);

  /// Marks the thread as running. Call it before the first tick.
  void begin(Nanoseconds now_ns = monotonic_ns()) noexcept;
  /// Counts one finished turn.
  void tick(Nanoseconds now_ns = monotonic_ns()) noexcept;
  /// Marks that the thread waits for something that may take any time. It cannot hang until its next tick.
  void rest() noexcept { last_ns_.store(kResting, std::memory_order_relaxed); }
  /// Marks that the thread has ended in an orderly way.
  void end(Nanoseconds now_ns = monotonic_ns()) noexcept { ended_ns_.store(now_ns); }

  const std::string& name() const noexcept { return name_; }
  /// Returns name, period, rate, ticks, idle_s and limit_s at `now_ns`, or at its end for a thread that has
  /// ended. The rate is that of the last whole second, or of the time since begin() if that is shorter.
  LoopStatistics statistics(Nanoseconds now_ns = monotonic_ns()) const;

 private:
  static constexpr Nanoseconds kSlot_ns = kNsPerSecond / 10, kResting = -1;
  static constexpr std::uint64_t kSlots = 16, kWindow = 10;  // slots kept; slots per second
  static constexpr unsigned kCountBits = 24;
  double rate_hz(Nanoseconds now_ns) const noexcept;

  std::string name_;
  double period_s_, limit_s_;
  std::atomic<Nanoseconds> begun_ns_{0}, last_ns_{0}, ended_ns_{0};
  std::atomic<std::uint64_t> ticks_{0};
  std::array<std::atomic<std::uint64_t>, kSlots> slots_{};  // slot number << kCountBits | ticks in that slot
};

}  // namespace phantom::core
