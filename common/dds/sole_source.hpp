#pragma once

#include <utility>

#include "common/dds/source_guard.hpp"

namespace phantom::dds {

/// SourceGuard for readers that show or sound what one process sends: tells of a second process only once the
/// followed one is heard after it. Whoever comes when that one has ended is its successor, of which nothing
/// needs to be said. One thread accepts.
class SoleSource {
 public:
  /// A second process is told of for so long.
  static constexpr core::Nanoseconds kSecond_ns = 2 * core::kNsPerSecond;

  explicit SoleSource(core::Nanoseconds hold_ns = SourceGuard::kHold_ns) : guard_(hold_ns) {}

  /// Whether a sample that is valid otherwise is newer than the last and of the process that is followed.
  /// Real-time safe: yes.
  bool accept(const msg::Stamp& stamp, core::Nanoseconds received_ns) noexcept {
    const auto verdict = guard_.assess(stamp, received_ns);
    if (verdict == SourceGuard::Verdict::kRival) other_heard_ = true;
    if (verdict != SourceGuard::Verdict::kAccepted) return false;
    const bool beside = std::exchange(other_heard_, false) && stamp.session() == session_;
    session_ = stamp.session();
    if (beside) second_ns_.store(received_ns, std::memory_order_relaxed);
    return true;
  }
  /// Whether two processes have been heard in turn lately. Thread-safe.
  bool has_second(core::Nanoseconds now_ns) const noexcept {
    const core::Nanoseconds second_ns = second_ns_.load(std::memory_order_relaxed);
    return second_ns != 0 && now_ns - second_ns < kSecond_ns;
  }
  /// Numbers of accepted sources that never came. The accepting thread's.
  std::uint64_t lost() const noexcept { return guard_.lost(); }

 private:
  SourceGuard guard_;
  std::uint64_t session_ = 0;
  bool other_heard_ = false;
  std::atomic<core::Nanoseconds> second_ns_{0};
};

}  // namespace phantom::dds
