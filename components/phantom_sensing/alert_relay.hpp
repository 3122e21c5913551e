#pragma once

#include <atomic>
#include <cstdint>
#include <thread>

#include "common/core/event_ring.hpp"
#include "common/core/progress.hpp"
#include "common/runtime/wake_signal.hpp"
#include "components/phantom_sensing/sensing_loop.hpp"

namespace phantom::phantom_sensing {

/// Passes drag and percept on at once and alerts from a thread of its own: their topic is reliable, a
/// write may be held up while a reader joins, and the haptic loop waits for the next drag.
class AlertRelay : public PerceptSink {
 public:
  static constexpr std::size_t kMostWaiting = 256;  ///< the monitors raise and clear fewer in a second

  /// `next` outlives this; its on_alert() is called on the relay's thread.
  /// `servo_priority`: to which the thread's is relative.
  explicit AlertRelay(PerceptSink& next, int servo_priority = 0);
  ~AlertRelay() override;

  void on_drag(const StepOutputs& outputs, const TickInfo& info) override { next_.on_drag(outputs, info); }
  void on_percept(const StepOutputs& outputs, const TickInfo& info) override {
    next_.on_percept(outputs, info);
  }
  /// Real-time safe: yes. What finds no room is left out, counted and told in the log.
  void on_alert(const percept::Alert& alert, bool cleared) override;
  /// Passes on what waits and ends the thread. After the last on_alert().
  void end();
  /// How the thread gets on. Thread-safe.
  const core::Progress& progress() const noexcept { return progress_; }
  std::uint64_t left_out() const noexcept { return left_out_.load(std::memory_order_relaxed); }

 private:
  struct Event {
    percept::Alert alert;
    bool cleared = false;
  };
  static constexpr double kHangsAfter_s = 5.0;  // a reader that joins may hold a write up for a while
  void work();

  PerceptSink& next_;
  core::EventRing<Event, kMostWaiting> waiting_;
  std::atomic<std::uint64_t> left_out_{0};
  std::atomic<bool> stop_{false};
  runtime::WakeSignal wake_;
  core::Progress progress_{"alerts", 0.0, kHangsAfter_s};
  std::thread thread_;
};

}  // namespace phantom::phantom_sensing
