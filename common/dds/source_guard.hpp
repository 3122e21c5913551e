#pragma once

#include <atomic>

#include "common/core/clock.hpp"
#include "common/core/health.hpp"
#include "common/dds/stamp.hpp"

namespace phantom::dds {

/// Order check of a periodic topic that has one writer at a time, for readers that act on it. Bound to the
/// process (session) whose sample it accepted first; another's are refused for as long as that one is heard,
/// so that two writers are never followed in turn. Once it has been silent for `hold`, the next writer is
/// accepted: its own restart, or a successor. Times are of one host's monotonic clock. One thread judges.
class SourceGuard {
 public:
  /// Longer than a busy host holds up a live writer, shorter than a restart takes.
  static constexpr core::Nanoseconds kHold_ns = core::kNsPerSecond / 2;
  /// A rival counts as present this long after its last sample.
  static constexpr core::Nanoseconds kRivalMemory_ns = 2 * core::kNsPerSecond;

  enum class Verdict { kAccepted, kOutOfOrder, kRival };

  SourceGuard() = default;
  explicit SourceGuard(core::Nanoseconds hold_ns) : hold_ns_(hold_ns) {}

  /// Judges a sample that is valid otherwise. Real-time safe: yes.
  Verdict judge(const msg::Stamp& stamp, core::Nanoseconds received_ns) noexcept;
  /// Whether another process was writing to the topic lately. Thread-safe.
  bool has_rival(core::Nanoseconds now_ns) const noexcept {
    const core::Nanoseconds rival_ns = rival_ns_.load(std::memory_order_relaxed);
    return rival_ns != 0 && now_ns - rival_ns < kRivalMemory_ns;
  }

 private:
  core::Nanoseconds hold_ns_ = kHold_ns, accepted_ns_ = 0;
  std::atomic<core::Nanoseconds> rival_ns_{0};
  SequenceGuard order_;
  std::uint64_t session_ = 0;
};

/// Why a sample was refused, in words for the log; null if it was accepted.
const char* reason(SourceGuard::Verdict verdict) noexcept;

/// `health` as it is told while a second process sends `topic`: degraded at least, and says so first.
core::Health with_rival(core::Health health, const char* topic);

}  // namespace phantom::dds
