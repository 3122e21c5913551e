#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "common/core/clock.hpp"
#include "common/dds/guid_prefix.hpp"

namespace phantom::dds {

/// Remembers which other participants announce themselves on a secured site without having shown who they
/// are, and says when to begin their handshake anew. Knows no DDS. Not thread-safe. Real-time safe: no.
class HandshakeWatch {
 public:
  /// A handshake over a bad link takes seconds; whoever has the smaller GUID loses patience first, so that
  /// two participants do not undo each other's attempt at the same time.
  static constexpr core::Nanoseconds kPatience = 10 * core::kNsPerSecond;
  static constexpr core::Nanoseconds kPatienceOfGreater = 15 * core::kNsPerSecond;
  /// Each attempt waits twice as long as the one before, up to this: on a starved machine a handshake takes
  /// its time, and a stranger never succeeds. Who leaves and returns within this time is not new.
  static constexpr core::Nanoseconds kMostPatience = 60 * core::kNsPerSecond;
  /// Attempts that one call of overdue() asks for, who waits longest first: strangers may be many.
  static constexpr std::size_t kMostAtOnce = 8;

  struct Attempt {
    GuidPrefix peer{};
    int number = 0;                   ///< 1 for the first with this peer since it was new or admitted
    core::Nanoseconds waited_ns = 0;  ///< since it was discovered
  };

  void discovered(const GuidPrefix& peer, core::Nanoseconds now);
  /// It has shown who it is; returns how many attempts that had taken.
  int admitted(const GuidPrefix& peer);
  /// It left, or was not heard for its lease. Returns whether it is gone: Fast DDS may tell of a peer's end
  /// only after it has told that it discovered the same one anew.
  bool left(const GuidPrefix& peer, core::Nanoseconds now);
  /// With whom `own` is to begin anew now; it is expected to do so.
  std::vector<Attempt> overdue(const GuidPrefix& own, core::Nanoseconds now);

 private:
  struct Peer {
    int present = 0;  // times discovered that it has not left; 0: remembered for its attempts
    bool waiting = false;
    core::Nanoseconds since = 0, last = 0;  // discovered; discovered, attempted or left
    int attempts = 0;
  };
  void forget(core::Nanoseconds now);

  std::map<GuidPrefix, Peer> peers_;
};

}  // namespace phantom::dds
