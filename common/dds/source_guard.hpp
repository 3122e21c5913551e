#pragma once

#include <atomic>

#include "common/core/clock.hpp"
#include "common/core/health.hpp"
#include "common/dds/stamp.hpp"

namespace phantom::dds {

/// For readers of a topic that has one writer at a time. Bound to the process (session) whose sample it
/// accepted first; another's are refused for as long as that one is heard, so that two writers are never
/// followed in turn. Once nothing was accepted for `hold`, whoever comes next is accepted: its own restart, a
/// successor, or the same one with whatever numbers, so that no sample can lock the reader out for longer.
/// Times are of this host's monotonic clock. One thread judges; what is said to be thread-safe may be called
/// by any.
///
/// `hold` is to be longer than a live writer is ever silent, and shorter than a restart takes: some periods
/// of a periodic topic, at least kHold_ns. A topic that is written now and then does not show whether its
/// writer lives; say so by heard() when a periodic topic of the same process comes (component_status: 2 Hz).
class SourceGuard {
 public:
  /// Longer than a busy host holds up a live writer, shorter than a restart takes.
  static constexpr core::Nanoseconds kHold_ns = core::kNsPerSecond / 2;
  /// A rival counts as present this long after its last sample, or for `hold` if that is longer.
  static constexpr core::Nanoseconds kRivalMemory_ns = 2 * core::kNsPerSecond;

  enum class Verdict { kAccepted, kOutOfOrder, kRival };

  SourceGuard() = default;
  explicit SourceGuard(core::Nanoseconds hold_ns) : hold_ns_(hold_ns) {}

  /// Judges a sample that is valid otherwise. Real-time safe: yes.
  Verdict assess(const msg::Stamp& stamp, core::Nanoseconds received_ns) noexcept;
  /// The process with that session is alive; keeps the guard bound if it is bound to it. Thread-safe.
  /// Real-time safe: yes.
  void heard(std::uint64_t session, core::Nanoseconds now_ns) noexcept;

  /// Whether another process was writing to the topic lately. Thread-safe.
  bool has_rival(core::Nanoseconds now_ns) const noexcept;
  /// The session of the other process that wrote last, and how many samples of others were refused since the
  /// start; 0 if there never were any. Thread-safe.
  std::uint64_t rival_session() const noexcept { return rival_session_.load(std::memory_order_relaxed); }
  std::uint64_t rival_samples() const noexcept { return rival_samples_.load(std::memory_order_relaxed); }
  /// The session to which it is bound, or was last; 0 if it never was. Thread-safe.
  std::uint64_t session() const noexcept { return session_.load(std::memory_order_relaxed); }
  /// Numbers of accepted sources that never came.
  std::uint64_t lost() const noexcept { return order_.lost(); }

 private:
  core::Nanoseconds hold_ns_ = kHold_ns, accepted_ns_ = 0;
  SequenceGuard order_;
  std::atomic<std::uint64_t> session_{0}, rival_session_{0}, rival_samples_{0};
  std::atomic<core::Nanoseconds> heard_ns_{0}, rival_ns_{0};
};

/// Why a sample was refused, in words for the log; null if it was accepted.
const char* reason(SourceGuard::Verdict verdict) noexcept;

/// `health` as it is told while a second process sends `topic`: degraded at least, and says so first.
core::Health with_rival(core::Health health, const char* topic);

}  // namespace phantom::dds
