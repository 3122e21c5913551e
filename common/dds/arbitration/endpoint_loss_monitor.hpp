#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/core/clock.hpp"
#include "common/dds/admission/handshake_watch.hpp"

namespace phantom::dds {

/// Remembers which readers and writers each participant had when it was lost, and decides with which peers to
/// restart discovery because they returned without all of them. Knows no DDS. Not thread-safe. Real-time
/// safe: no.
class EndpointLossMonitor {
 public:
  using End = std::uint32_t;  ///< entity id, unique in its participant

  /// Time without news of a participant's endpoints after which discovery with it restarts. The
  /// participant with the greater GUID waits half as long again, so that two do not undo each other's
  /// attempts. Each attempt waits twice as long as the one before: the missing endpoint may have been closed
  /// meanwhile, and then no attempt succeeds.
  static constexpr core::Nanoseconds kPatience = 3 * core::kNsPerSecond;
  static constexpr core::Nanoseconds kPatienceIfSecured = 10 * core::kNsPerSecond;
  static constexpr int kMaxAttempts = 6;
  /// An endpoint that was removed less than this before its participant counts as lost together with it.
  static constexpr core::Nanoseconds kTogether = core::kNsPerSecond;
  /// Number of lost participants that are remembered; the one lost first is forgotten first.
  static constexpr std::size_t kMaxLost = 256;

  struct Attempt {
    GuidPrefix peer{};
    int number = 0;  ///< 1 for the first since it returned
    std::size_t missing = 0;
  };

  explicit EndpointLossMonitor(core::Nanoseconds patience = kPatience) : patience_(patience) {}

  /// Records that `peer` was discovered, and admitted if the site is secured.
  void discovered(const GuidPrefix& peer, core::Nanoseconds now);
  /// Records that `peer` left, or was not heard for its lease. Returns whether it is gone: Fast DDS may
  /// report a peer's end only after it has reported the same peer as rediscovered.
  bool left(const GuidPrefix& peer, core::Nanoseconds now);
  void end_discovered(const GuidPrefix& peer, End end, core::Nanoseconds now);
  void end_removed(const GuidPrefix& peer, End end, core::Nanoseconds now);
  /// Returns the peers with which `own` must restart discovery now; the caller is expected to do so.
  std::vector<Attempt> overdue(const GuidPrefix& own, core::Nanoseconds now);
  /// Returns how many lost participants were forgotten for others.
  std::uint64_t forgotten() const { return forgotten_; }

 private:
  enum class EndState { kKnown, kMissing, kRemoved };
  struct KnownEnd {
    EndState state = EndState::kKnown;
    core::Nanoseconds removed = 0;
  };
  struct Peer {
    int present = 0;             // how often it was discovered, minus how often it left
    core::Nanoseconds last = 0;  // newest discovery of it or its endpoints, departure or attempt
    int attempts = 0;
    std::map<End, KnownEnd> ends;
  };
  void forget_oldest();

  core::Nanoseconds patience_;
  std::map<GuidPrefix, Peer> peers_;
  std::uint64_t forgotten_ = 0;
};

}  // namespace phantom::dds
