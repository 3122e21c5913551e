#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include "common/core/clock.hpp"
#include "common/core/status.hpp"

namespace phantom::ros2_gateway {

/// What identifies a message of a stream that one publisher sends.
struct StreamMessage {
  core::Nanoseconds stamp_ns = 0;            ///< since 1970, by the sender's clock; 0: none
  std::array<std::uint8_t, 12> publisher{};  ///< GUID prefix of its participant
};

/// Keeps a topic to one publisher at a time and to messages that are new. Not thread-safe; allocates in
/// refusals only.
class StreamCheck {
 public:
  /// `staleness_s`: another publisher may take over once the first was silent for so long.
  /// `largest_stamp_age_s`: late or early, by this host's clock; 0: not judged.
  StreamCheck(double staleness_s, double largest_stamp_age_s)
      : staleness_ns_(core::from_seconds(staleness_s)), largest_age_s_(largest_stamp_age_s) {}

  /// Takes a message that arrived at `now_ns` (monotonic; `utc_now_ns` is the same time since 1970). Refuses
  /// one of a second publisher while the first is heard, one whose stamp is too far from this host's clock,
  /// and one that is not newer than the last, within staleness_s.
  core::Status accept(const StreamMessage& message, core::Nanoseconds now_ns, core::Nanoseconds utc_now_ns) {
    const bool heard = fresh(now_ns);
    if (heard && message.publisher != publisher_)
      return core::Status::invalid_argument("a second publisher; allowed: one at a time");
    const double age_s = core::seconds(utc_now_ns - message.stamp_ns);
    if (message.stamp_ns != 0 && largest_age_s_ > 0.0 && !(std::abs(age_s) <= largest_age_s_))
      return core::Status::invalid_argument(
          "stamped " + std::to_string(std::abs(age_s)) + " s " + (age_s > 0.0 ? "ago" : "ahead") +
          "; allowed: " + std::to_string(largest_age_s_) + " s. Are both hosts' clocks set?");
    if (heard && message.stamp_ns != 0 && message.stamp_ns <= stamp_ns_)
      return core::Status::invalid_argument("not newer than the last");
    publisher_ = message.publisher;
    stamp_ns_ = message.stamp_ns;
    at_ns_ = now_ns;
    return core::Status::ok();
  }
  /// Returns whether a message was accepted within staleness_s. Real-time safe: yes.
  bool fresh(core::Nanoseconds now_ns) const noexcept {
    return at_ns_ != 0 && now_ns - at_ns_ <= staleness_ns_;
  }

 private:
  core::Nanoseconds staleness_ns_;
  double largest_age_s_;
  std::array<std::uint8_t, 12> publisher_{};
  core::Nanoseconds stamp_ns_ = 0, at_ns_ = 0;
};

}  // namespace phantom::ros2_gateway
