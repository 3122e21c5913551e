#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>

#include "common/core/clock.hpp"
#include "common/core/event_ring.hpp"

namespace phantom::core {

/// Within this time both sides say that they are stopped, or the operator is told who has not.
inline constexpr Nanoseconds kStopConfirmedWithin_ns = 300 * kNsPerMillisecond;

/// Why a side is stopped. Numbered as in the topics' StopCause.
enum class StopCause : std::uint32_t {
  kNone,        ///< it is not
  kEmergency,   ///< somebody asked for it
  kDriveFault,  ///< its own drives are in fault
  kPartner,     ///< the other side is stopped
};
inline constexpr std::uint32_t kStopCauses = 4;

/// In words: "", "emergency stop", "drives in fault", "the other side is stopped".
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

/// A person's reset: releases the stops that it names and no other, so that it never undoes a stop that the
/// person did not know of. Stops are named as in the topics' field `stop`.
struct StopReset {
  std::uint64_t own = 0;      ///< of the side that gets it; 0: that side was not stopped
  std::uint64_t partner = 0;  ///< of the other side
};

/// Emergency stops and resets on their way from any thread to the servo thread, and what came of the resets
/// on its way back. No stop is ever lost: stops are counted, not queued.
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

  /// Asks for an emergency stop; returns how many have been asked for. Any thread; real-time safe: yes.
  std::uint32_t stop() noexcept { return stops_.fetch_add(1, std::memory_order_acq_rel) + 1; }
  /// Asks for a reset; returns its number, or 0 where too many wait. Any thread but the servo's.
  std::uint32_t reset(const StopReset& names) noexcept {
    const std::lock_guard lock(mutex_);
    if (!resets_.put({resets_made_ + 1, names})) return 0;
    return ++resets_made_;
  }
  /// What came of a reset; false if there is nothing new. One thread.
  bool take_result(Result& result) noexcept { return results_.take(result); }

  /// Stops asked for so far. Real-time safe: yes.
  std::uint32_t stops() const noexcept { return stops_.load(std::memory_order_acquire); }
  /// The oldest reset that waits; false if none does. Servo thread only. Real-time safe: yes.
  bool take(Reset& reset) noexcept { return resets_.take(reset); }
  /// Tells what came of a reset. Servo thread only. Real-time safe: yes.
  void give_result(const Result& result) noexcept { results_.put(result); }

 private:
  std::atomic<std::uint32_t> stops_{0};
  std::mutex mutex_;  // of the writers of resets_
  std::uint32_t resets_made_ = 0;
  EventRing<Reset, 16> resets_;
  EventRing<Result, 64> results_;
};

}  // namespace phantom::core
