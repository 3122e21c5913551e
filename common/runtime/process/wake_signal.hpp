#pragma once

#include <semaphore.h>
#include <time.h>

#include <cerrno>

#include "common/core/clock.hpp"

namespace phantom::runtime {

/// Lets one thread wake another, e.g. a servo loop its I/O thread. It is a POSIX semaphore, so raise() never
/// blocks.
class WakeSignal {
 public:
  WakeSignal() { sem_init(&semaphore_, 0, 0); }
  ~WakeSignal() { sem_destroy(&semaphore_); }
  WakeSignal(const WakeSignal&) = delete;
  WakeSignal& operator=(const WakeSignal&) = delete;

  /// Wakes the waiting thread, now or at its next wait(). Real-time safe: yes.
  void raise() noexcept { sem_post(&semaphore_); }
  /// Waits at most `limit_s` for raise(). Several pending wake-ups count as one. Returns whether it was
  /// raised.
  bool wait(double limit_s) noexcept {
    const core::Nanoseconds until_ns = core::monotonic_ns() + core::from_seconds(limit_s);
    const timespec until{until_ns / core::kNsPerSecond, until_ns % core::kNsPerSecond};
    while (sem_clockwait(&semaphore_, CLOCK_MONOTONIC, &until) != 0) {
      if (errno != EINTR) return false;
    }
    while (sem_trywait(&semaphore_) == 0) {
    }
    return true;
  }

 private:
  sem_t semaphore_;
};

}  // namespace phantom::runtime
