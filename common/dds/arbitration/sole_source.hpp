#pragma once

#include <utility>

#include "common/dds/admission/source_guard.hpp"

namespace phantom::dds {

/// A SourceGuard for readers that show or sound what one process sends. It reports a second process only once
/// the followed one is heard again after it. A process that comes after the followed one has ended is its
/// successor and is not reported. One thread calls accept().
class SoleSource {
 public:
  /// A second process is reported for this long.
  static constexpr core::Nanoseconds kSecond_ns = 2 * core::kNsPerSecond;

  explicit SoleSource(core::Nanoseconds hold_ns = SourceGuard::kHold_ns) : guard_(hold_ns) {}
  /// A copy goes on by itself. The one that is copied must not be in use meanwhile.
  SoleSource(const SoleSource& other) noexcept { *this = other; }
  SoleSource& operator=(const SoleSource& other) noexcept {
    guard_ = other.guard_;
    session_ = other.session_;
    other_heard_ = other.other_heard_;
    second_ns_ = other.second_ns_.load();
    return *this;
  }
  ~SoleSource() = default;

  /// Returns whether a sample that is otherwise valid is newer than the last one and comes from the followed
  /// process. Real-time safe: yes.
  bool accept(const msg::Stamp& stamp, core::Nanoseconds received_ns) noexcept {
    const auto verdict = guard_.assess(stamp, received_ns);
    if (verdict == SourceGuard::Verdict::kRival) other_heard_ = true;
    if (verdict != SourceGuard::Verdict::kAccepted) return false;
    const bool beside = std::exchange(other_heard_, false) && stamp.session() == session_;
    session_ = stamp.session();
    if (beside) second_ns_.store(received_ns, std::memory_order_relaxed);
    return true;
  }
  /// Returns whether two processes have been heard in turn lately. Thread-safe.
  bool has_second(core::Nanoseconds now_ns) const noexcept {
    const core::Nanoseconds second_ns = second_ns_.load(std::memory_order_relaxed);
    return second_ns != 0 && now_ns - second_ns < kSecond_ns;
  }
  /// Returns how many sequence numbers of accepted sources never arrived. The accepting thread only.
  std::uint64_t lost() const noexcept { return guard_.lost(); }

 private:
  SourceGuard guard_;
  std::uint64_t session_ = 0;
  bool other_heard_ = false;
  std::atomic<core::Nanoseconds> second_ns_{0};
};

}  // namespace phantom::dds
