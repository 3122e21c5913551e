#pragma once

#include <atomic>
#include <cstdint>
#include <thread>
#include <variant>

#include "common/core/event_ring.hpp"
#include "common/core/progress.hpp"
#include "common/runtime/process/wake_signal.hpp"
#include "components/phantom_sensing/sensing_loop.hpp"

namespace phantom::phantom_sensing {

/// What an AlertRelay has waiting.
struct RaisedAlert {
  percept::Alert alert;
  bool cleared = false;
};
struct RaisedDoubt {
  percept::ModelDoubt doubt;
  bool holds = false;
};

/// Passes drag and percept on immediately, and alerts and doubts from its own thread. Their topics are
/// reliable: a write can block while a reader joins, and the haptic loop must not wait for it.
class AlertRelay : public PerceptSink {
 public:
  static constexpr std::size_t kMaxWaiting = 256;  ///< more than the monitors raise and clear in a second

  /// `next` must outlive this; its on_alert() is called on the relay's thread. The priority of that thread is
  /// relative to `servo_priority`.
  explicit AlertRelay(PerceptSink& next, int servo_priority = 0);
  ~AlertRelay() override;

  void on_drag(const StepOutputs& outputs, const TickInfo& info) override { next_.on_drag(outputs, info); }
  void on_percept(const StepOutputs& outputs, const TickInfo& info) override {
    next_.on_percept(outputs, info);
  }
  /// Queues the alert. If the queue is full, the alert is dropped, counted and reported in the log. Real-time
  /// safe: yes.
  void on_alert(const percept::Alert& alert, bool cleared) override;
  /// Likewise.
  void on_doubt(const percept::ModelDoubt& doubt, bool holds) override;
  /// Passes on the queued alerts and ends the thread. Call it after the last on_alert().
  void end();
  /// Returns the thread's progress. Thread-safe.
  const core::Progress& progress() const noexcept { return progress_; }
  std::uint64_t left_out() const noexcept { return left_out_.load(std::memory_order_relaxed); }

 private:
  using Event = std::variant<RaisedAlert, RaisedDoubt>;
  void put(const Event& event);
  static constexpr double kHangsAfter_s = 5.0;  // a joining reader can block a write for a while
  void work();

  PerceptSink& next_;
  core::EventRing<Event, kMaxWaiting> waiting_;
  std::atomic<std::uint64_t> left_out_{0};
  std::atomic<bool> stop_{false};
  runtime::WakeSignal wake_;
  core::Progress progress_{"alerts", 0.0, kHangsAfter_s};
  std::thread thread_;
};

}  // namespace phantom::phantom_sensing
