#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>

#include "common/core/clock.hpp"
#include "common/core/event_ring.hpp"

namespace phantom::teleop {

/// Within this time both sides confirm a stop; otherwise the operator sees which side has not.
inline constexpr core::Nanoseconds kStopConfirmedWithin_ns = 300 * core::kNsPerMillisecond;

/// Why a side is stopped. The numbers equal those of the topics' StopCause.
enum class StopCause : std::uint32_t {
  kNone,        ///< it is not stopped
  kEmergency,   ///< an emergency stop was requested
  kDriveFault,  ///< its own drives are in fault
  kPartner,     ///< the other side is stopped
};
inline constexpr std::uint32_t kStopCauses = 4;

/// Returns the cause in words: "", "emergency stop", "drives in fault", "the other side is stopped".
inline const char* name_of(StopCause cause) noexcept {
  switch (cause) {
    case StopCause::kNone:
      return "";
    case StopCause::kEmergency:
      return "emergency stop";
    case StopCause::kDriveFault:
      return "drives in fault";
    case StopCause::kPartner:
      return "the other side is stopped";
  }
  return "unknown";
}

/// A person's reset. It releases only the stops that it names, so that it never releases a stop that the
/// person did not know of. Stops are named as in the topics' field `stop`.
struct StopReset {
  std::uint64_t own = 0;      ///< the stop of the side that receives the reset; 0: that side was not stopped
  std::uint64_t partner = 0;  ///< the stop of the other side
};

/// Passes emergency stops and resets from any thread to the servo thread, and the results of the resets back.
/// No stop is ever lost: stops are counted, not queued. Neither is the result of a reset that was accepted.
class StopRequests {
 public:
  struct Reset {
    std::uint32_t number = 0;  ///< as reset() returned it
    StopReset names;
  };
  struct Result {
    std::uint32_t number = 0;
    bool released = false;
  };

  /// Requests an emergency stop; returns how many have been requested so far. Any thread; real-time safe:
  /// yes.
  std::uint32_t stop() noexcept { return stops_.fetch_add(1, std::memory_order_acq_rel) + 1; }
  /// Requests a reset; returns its number, or 0 if too many wait, or too many results do. Any thread but the
  /// servo's.
  std::uint32_t reset(const StopReset& names) noexcept {
    const std::lock_guard lock(mutex_);
    const std::uint32_t unanswered = resets_made_ - results_taken_.load(std::memory_order_acquire);
    if (unanswered == kMaxUnanswered || !resets_.put({resets_made_ + 1, names})) return 0;
    return ++resets_made_;
  }
  /// Takes the result of a reset; returns false if there is no new one. Always from the same thread.
  bool take_result(Result& result) noexcept {
    if (!results_.take(result)) return false;
    results_taken_.fetch_add(1, std::memory_order_release);
    return true;
  }

  /// Returns the number of stops requested so far. Real-time safe: yes.
  std::uint32_t stops() const noexcept { return stops_.load(std::memory_order_acquire); }
  /// Takes the oldest waiting reset; returns false if none waits. Servo thread only. Real-time safe: yes.
  bool take(Reset& reset) noexcept { return resets_.take(reset); }
  /// Reports the result of a reset. Servo thread only. Real-time safe: yes.
  void give_result(const Result& result) noexcept { results_.put(result); }

 private:
  static constexpr std::uint32_t kMaxUnanswered = 64;  // resets with a result that has not been read
  std::atomic<std::uint32_t> stops_{0};
  std::mutex mutex_;  // guards the writing end of resets_
  std::uint32_t resets_made_ = 0;
  core::EventRing<Reset, 16> resets_;
  core::EventRing<Result, kMaxUnanswered> results_;  // has room for the result of every reset
  std::atomic<std::uint32_t> results_taken_{0};
};

}  // namespace phantom::teleop
