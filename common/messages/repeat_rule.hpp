#pragma once

#include <chrono>
#include <cstdint>

namespace phantom::messages {

/// Decides when a requester sends its command again: every kAgain until it is replied to, as a reply may have
/// been sent before our reader was matched; from then on only where nothing was heard for kSilent, as the
/// last reply may have been lost; and at once when another process joins that may answer. Knows no clock.
/// Real-time safe: yes.
class RepeatRule {
 public:
  using Time = std::chrono::steady_clock::time_point;
  static constexpr std::chrono::milliseconds kAgain{100};
  static constexpr std::chrono::seconds kSilent{3};

  /// Returns whether to send now; the caller is expected to do so. `ends`: how many processes may answer.
  bool due(Time now, std::uint32_t ends) {
    const bool send = ends > ends_ || (ends > 0 && now >= next_);
    ends_ = ends;
    if (send) next_ = now + kAgain;
    return send;
  }
  /// A reply came that is not the last.
  void heard(Time now) { next_ = now + kSilent; }

 private:
  std::uint32_t ends_ = 0;
  Time next_ = Time::min();
};

}  // namespace phantom::messages
