#pragma once

#include <atomic>

#include "common/core/clock.hpp"
#include "common/core/health.hpp"
#include "common/dds/endpoints/stamp.hpp"

namespace phantom::dds {

/// Arbitrates between the writers of a topic that has one at a time. The one rule: the guard binds to the
/// process (session) whose sample it accepts first, and refuses samples of other processes for as long as
/// that one is heard, so that the reader never follows two writers in turn. Once nothing was accepted for
/// `hold`, the guard accepts the next sample: from the restarted process, a successor, or the same process
/// with any numbers. No sample can therefore lock the reader out for longer. Times are those of one monotonic
/// clock: this host's, or a recording's. One thread calls assess(); any thread may call the functions marked
/// thread-safe.
///
/// `hold` must be longer than a live writer is ever silent, and shorter than a restart takes: some periods of
/// a periodic topic, at least kHold_ns. A topic that is written only now and then does not show whether its
/// writer lives. Call heard() when a sample of a periodic topic of the same process arrives
/// (component_status: 2 Hz).
class SourceGuard {
 public:
  /// Longer than a busy host delays a live writer, shorter than a restart takes.
  static constexpr core::Nanoseconds kHold_ns = core::kNsPerSecond / 2;
  /// A rival counts as present for this long after its last sample, or for `hold` if that is longer.
  static constexpr core::Nanoseconds kRivalMemory_ns = 2 * core::kNsPerSecond;

  enum class Verdict { kAccepted, kOutOfOrder, kRival };

  SourceGuard() = default;
  explicit SourceGuard(core::Nanoseconds hold_ns) : hold_ns_(hold_ns) {}
  /// A copy goes on by itself. The one that is copied must not be in use meanwhile.
  SourceGuard(const SourceGuard& other) noexcept { *this = other; }
  SourceGuard& operator=(const SourceGuard& other) noexcept;
  ~SourceGuard() = default;

  /// Assesses a sample that is otherwise valid. Real-time safe: yes.
  Verdict assess(const msg::Stamp& stamp, core::Nanoseconds received_ns) noexcept;
  /// Reports that the process with that session is alive; keeps the guard bound to it if it is bound already.
  /// Thread-safe. Real-time safe: yes.
  void heard(std::uint64_t session, core::Nanoseconds now_ns) noexcept;

  /// Assesses likewise a sample of a topic that is written on events: between two of them nothing shows
  /// whether their writer lives. They are taken from the process that `periodic` follows on a periodic topic,
  /// from any process while that follows none, in the order of their numbers. Real-time safe: yes.
  Verdict assess_event(const msg::Stamp& stamp, core::Nanoseconds received_ns,
                       const SourceGuard& periodic) noexcept;

  /// Returns whether the guard is bound to another process than the one of `stamp`. Thread-safe.
  bool is_rival(const msg::Stamp& stamp, core::Nanoseconds now_ns) const noexcept;
  /// Returns whether another process has written to the topic recently: a second one, or a successor that
  /// came before `hold` was over. Thread-safe.
  bool has_rival(core::Nanoseconds now_ns) const noexcept;
  /// Returns whether the followed process was received after a foreign writer recently: both are there, which
  /// no succession explains. For readers that must not report each restart. Thread-safe.
  bool has_second(core::Nanoseconds now_ns) const noexcept;
  /// Return the session of the other process that wrote last, and how many samples of others were refused
  /// since the start; 0 if there were none. Thread-safe.
  std::uint64_t rival_session() const noexcept { return rival_session_.load(std::memory_order_relaxed); }
  std::uint64_t rival_samples() const noexcept { return rival_samples_.load(std::memory_order_relaxed); }
  /// Returns the session to which the guard is or was last bound; 0 if it never was. Thread-safe.
  std::uint64_t session() const noexcept { return session_.load(std::memory_order_relaxed); }
  /// Returns how many sequence numbers of accepted sources never arrived. The assessing thread only.
  std::uint64_t lost() const noexcept { return order_.lost(); }

 private:
  Verdict refuse_rival(const msg::Stamp& stamp, core::Nanoseconds received_ns) noexcept;

  core::Nanoseconds hold_ns_ = kHold_ns, accepted_ns_ = 0;
  SequenceGuard order_;
  bool rival_since_accepted_ = false;
  std::atomic<std::uint64_t> session_{0}, rival_session_{0}, rival_samples_{0};
  std::atomic<core::Nanoseconds> heard_ns_{0}, rival_ns_{0}, second_ns_{0};
};

/// Returns why a sample was refused, in words for the log; null if it was accepted.
const char* reason(SourceGuard::Verdict verdict) noexcept;

/// Returns `health` for publication while a second process sends `topic`: degraded at least, with a message
/// that begins with that fact.
core::Health with_rival(core::Health health, const char* topic);

}  // namespace phantom::dds
