#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "common/core/clock.hpp"
#include "common/dds/admission/guid_prefix.hpp"

namespace phantom::dds {

/// Remembers which other participants announce themselves on a secured site without having authenticated, and
/// decides when to restart their handshake. Knows no DDS. Not thread-safe. Real-time safe: no.
class HandshakeWatch {
 public:
  /// A handshake over a bad link takes seconds. The participant with the smaller GUID restarts it first, so
  /// that two participants do not undo each other's attempt at the same time.
  static constexpr core::Nanoseconds kPatience = 10 * core::kNsPerSecond;
  static constexpr core::Nanoseconds kPatienceOfGreater = 15 * core::kNsPerSecond;
  /// Each attempt waits twice as long as the one before, up to this limit: on an overloaded machine a
  /// handshake takes its time, and a participant without valid documents never succeeds. A peer that leaves
  /// and returns within this time does not count as new.
  static constexpr core::Nanoseconds kMaxPatience = 60 * core::kNsPerSecond;
  /// Number of attempts that one call of overdue() returns at most, the longest waiting first: there may be
  /// many participants without valid documents.
  static constexpr std::size_t kMaxAtOnce = 8;

  struct Attempt {
    GuidPrefix peer{};
    int number = 0;                   ///< 1 for the first with this peer since it was new or was admitted
    core::Nanoseconds waited_ns = 0;  ///< time since it was discovered
  };

  void discovered(const GuidPrefix& peer, core::Nanoseconds now);
  /// Records that `peer` has authenticated; returns how many attempts that took.
  int admitted(const GuidPrefix& peer);
  /// Records that `peer` left, or was not heard for its lease. Returns whether it is gone: Fast DDS may
  /// report a peer's end only after it has reported the same peer as rediscovered.
  bool left(const GuidPrefix& peer, core::Nanoseconds now);
  /// Returns the peers with which `own` must restart the handshake now; the caller is expected to do so.
  std::vector<Attempt> overdue(const GuidPrefix& own, core::Nanoseconds now);

 private:
  struct Peer {
    int present = 0;  // how often it was discovered, minus how often it left; 0: kept only for its attempts
    bool waiting = false;
    core::Nanoseconds since = 0, last = 0;  // last: newest discovery, attempt or departure
    int attempts = 0;
  };
  void forget(core::Nanoseconds now);

  std::map<GuidPrefix, Peer> peers_;
};

}  // namespace phantom::dds
