#pragma once

#include <atomic>
#include <cstdint>

#include "common/core/status.hpp"

namespace phantom::slave_io {

/// A person's request to home the drives, between the thread that takes commands and the servo's. Real-time
/// safe: yes.
class HomingRequest {
 public:
  enum class State : std::uint8_t { kNotNeeded, kNotYet, kStopped, kWithheld, kPossible, kRuns };
  /// Servo thread: reports what would become of a request now.
  void report(State state) noexcept { state_.store(state, std::memory_order_release); }
  /// Servo thread: returns once whether homing was requested.
  bool take() noexcept { return requested_.exchange(false, std::memory_order_acq_rel); }
  /// Requests it, or returns why it is refused and what is allowed.
  core::Status ask();

 private:
  std::atomic<State> state_{State::kNotNeeded};
  std::atomic<bool> requested_{false};
};

}  // namespace phantom::slave_io
