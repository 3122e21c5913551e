#pragma once

#include <cstdint>

#include "common/core/clock.hpp"

namespace phantom::core {

/// Limits how often an event is logged: kBurst lines in each period, the rest is counted. Not thread-safe.
/// Real-time safe: yes.
class LogRate {
 public:
  static constexpr int kBurst = 10;
  static constexpr Nanoseconds kPeriod_ns = 5 * kNsPerSecond;

  struct Answer {
    bool log = false;
    std::uint64_t left_out = 0;  ///< events since the last one that was logged, which were not
  };
  /// Returns whether to log an event at `now_ns` of the monotonic clock.
  Answer admit(Nanoseconds now_ns) noexcept {
    if (begun_ns_ == 0 || now_ns - begun_ns_ >= kPeriod_ns) {
      begun_ns_ = now_ns;
      logged_ = 0;
    }
    if (logged_ >= kBurst) {
      ++left_out_;
      return {};
    }
    ++logged_;
    const Answer answer{true, left_out_};
    left_out_ = 0;
    return answer;
  }

 private:
  Nanoseconds begun_ns_ = 0;
  int logged_ = 0;
  std::uint64_t left_out_ = 0;
};

}  // namespace phantom::core
