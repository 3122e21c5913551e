#pragma once

#include <atomic>

#include "common/core/status.hpp"
#include "common/teleop/guards/wrist_sensor.hpp"

namespace phantom::slave_io {

/// A person's request to tare the sensor at the wrist, between the thread that takes commands
/// and the servo's. Real-time safe: yes, but for ask().
class TareRequest {
 public:
  /// Servo thread: reports why a request would be refused now. Before that, there is no sensor.
  void report(teleop::TareRefusal refusal) noexcept {
    refusal_.store(static_cast<int>(refusal), std::memory_order_release);
  }
  /// Servo thread: returns once whether a tare was requested.
  bool take() noexcept { return requested_.exchange(false, std::memory_order_acq_rel); }
  /// Requests it, or returns why it is refused and what is allowed.
  core::Status ask();

 private:
  static constexpr int kNoSensor = -1;
  std::atomic<int> refusal_{kNoSensor};
  std::atomic<bool> requested_{false};
};

}  // namespace phantom::slave_io
