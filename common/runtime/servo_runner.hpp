#pragma once

#include <functional>
#include <string>
#include <thread>
#include <vector>

#include "common/runtime/periodic_loop.hpp"

namespace phantom::runtime {

/// Runs a servo loop in a thread of its own. On request it runs an empty loop of the same period and
/// scheduling beside it, which shows the best that the host can do while the servo runs. Both end with the
/// process's stop request.
class ServoRunner {
 public:
  /// Starts the loops at once. `tick` must outlive the runner and be real-time safe.
  ServoRunner(double period_s, LoopScheduling scheduling, bool with_bare_loop,
              std::function<void(double dt_s)> tick)
      : servo_("servo", period_s, core::ThreadRole::kServo, scheduling),
        bare_("bare_loop", period_s, core::ThreadRole::kBareLoop, scheduling),
        tick_(std::move(tick)) {
    servo_thread_ = std::jthread([this] {
      servo_.run([this](double dt_s) {
        tick_(dt_s);
        return true;
      });
    });
    if (with_bare_loop) bare_thread_ = std::jthread([this] { bare_.run([](double) { return true; }); });
    with_bare_loop_ = with_bare_loop;
  }
  ServoRunner(const ServoRunner&) = delete;
  ServoRunner& operator=(const ServoRunner&) = delete;
  ~ServoRunner() { stop(); }

  /// Stops both loops and waits for their threads.
  void stop() {
    servo_.stop();
    bare_.stop();
    if (servo_thread_.joinable()) servo_thread_.join();
    if (bare_thread_.joinable()) bare_thread_.join();
  }
  /// Adds the thread to statistics(); it must outlive the runner.
  void watch(const core::Progress& thread) { watched_.push_back(&thread); }
  /// Returns the newest statistics of the servo, of the bare loop if it runs, and of the watched threads.
  /// Only one thread may call it.
  std::vector<core::LoopStatistics> statistics() {
    std::vector<core::LoopStatistics> all{servo_.statistics()};
    if (with_bare_loop_) all.push_back(bare_.statistics());
    for (const core::Progress* thread : watched_) all.push_back(thread->statistics());
    return all;
  }
  /// Returns once what the servo's thread was refused at its set-up; empty if nothing was (yet), or if it was
  /// returned before.
  std::string take_notice() {
    std::string notice = notice_taken_ ? std::string() : servo_.notice();
    notice_taken_ = notice_taken_ || !notice.empty();
    return notice;
  }

 private:
  PeriodicLoop servo_, bare_;
  std::function<void(double)> tick_;
  bool with_bare_loop_ = false, notice_taken_ = false;
  std::vector<const core::Progress*> watched_;
  std::jthread servo_thread_, bare_thread_;
};

}  // namespace phantom::runtime
