#pragma once

#include <algorithm>
#include <chrono>
#include <mutex>
#include <thread>

namespace phantom::test {

/// A plain thread that sleeps a few milliseconds at a time, and how late it woke: what a machine that is busy
/// does to any thread in the same moment. A bound of a time is widened by that, once for each thread on the
/// way, so that it holds on a slow machine and is sharp on a quiet one.
class LateSleeper {
 public:
  LateSleeper()
      : thread_([this](const std::stop_token& stop) {
          while (!stop.stop_requested()) {
            const auto due = std::chrono::steady_clock::now() + kSleep;
            std::this_thread::sleep_until(due);
            const std::chrono::duration<double> late = std::chrono::steady_clock::now() - due;
            const std::lock_guard lock(mutex_);
            greatest_s_ = std::max(greatest_s_, late.count());
          }
        }) {}

  /// Returns the greatest lateness since it began, or since the last begin().
  double greatest_s() {
    const std::lock_guard lock(mutex_);
    return greatest_s_;
  }
  void begin() {
    const std::lock_guard lock(mutex_);
    greatest_s_ = 0.0;
  }

 private:
  static constexpr std::chrono::milliseconds kSleep{5};
  std::mutex mutex_;
  double greatest_s_ = 0.0;
  std::jthread thread_;
};

}  // namespace phantom::test
