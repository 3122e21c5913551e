#pragma once

#include <semaphore.h>
#include <time.h>

#include <cerrno>

#include "common/core/clock.hpp"

namespace phantom::runtime {

/// Wakes one thread from another, e.g. a servo loop's I/O thread. A POSIX semaphore: raising it never blocks.
class WakeSignal {
 public:
  WakeSignal() { sem_init(&semaphore_, 0, 0); }
  ~WakeSignal() { sem_destroy(&semaphore_); }
  WakeSignal(const WakeSignal&) = delete;
  WakeSignal& operator=(const WakeSignal&) = delete;

  /// Wakes the waiter, now or at its next wait(). Real-time safe: yes.
  void raise() noexcept { sem_post(&semaphore_); }
  /// Waits for raise(), at most `limit_s`; wake-ups that piled up count as one. Returns whether it was
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
