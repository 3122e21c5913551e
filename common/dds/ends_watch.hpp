#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "common/core/clock.hpp"
#include "common/dds/handshake_watch.hpp"

namespace phantom::dds {

/// Remembers which readers and writers each participant had when it was lost, and says with whom to begin
/// anew because it has returned without them all. Knows no DDS. Not thread-safe. Real-time safe: no.
class EndsWatch {
 public:
  using End = std::uint32_t;  ///< entity id, unique in its participant

  /// How long nothing may come of a participant before it is begun anew with. Whoever has the greater GUID
  /// waits half as long again, so that two do not undo each other's attempt, and each attempt twice as long
  /// as the one before: an end may have been closed meanwhile, and then none succeeds.
  static constexpr core::Nanoseconds kPatience = 3 * core::kNsPerSecond;
  static constexpr core::Nanoseconds kPatienceIfSecured = 10 * core::kNsPerSecond;
  static constexpr int kMostAttempts = 6;
  /// Ends that went less than this before their participant went with it.
  static constexpr core::Nanoseconds kTogether = core::kNsPerSecond;
  /// Lost participants that are remembered; the one that was lost first is forgotten first.
  static constexpr std::size_t kMostLost = 256;

  struct Attempt {
    GuidPrefix peer{};
    int number = 0;  ///< 1 for the first since it returned
    std::size_t missing = 0;
  };

  explicit EndsWatch(core::Nanoseconds patience = kPatience) : patience_(patience) {}

  /// It is there, and admitted if the site is secured.
  void discovered(const GuidPrefix& peer, core::Nanoseconds now);
  /// It left, or was not heard for its lease. Returns whether it is gone: Fast DDS may tell of a peer's end
  /// only after it has told that it discovered the same one anew.
  bool left(const GuidPrefix& peer, core::Nanoseconds now);
  void end_discovered(const GuidPrefix& peer, End end, core::Nanoseconds now);
  void end_removed(const GuidPrefix& peer, End end, core::Nanoseconds now);
  /// With whom `own` is to begin anew now; it is expected to do so.
  std::vector<Attempt> overdue(const GuidPrefix& own, core::Nanoseconds now);

 private:
  enum class EndState { kKnown, kMissing, kRemoved };
  struct KnownEnd {
    EndState state = EndState::kKnown;
    core::Nanoseconds removed = 0;
  };
  struct Peer {
    int present = 0;             // times discovered that it has not left
    core::Nanoseconds last = 0;  // discovered, an end of it discovered, left, or attempted
    int attempts = 0;
    std::map<End, KnownEnd> ends;
  };
  void forget_oldest();

  core::Nanoseconds patience_;
  std::map<GuidPrefix, Peer> peers_;
};

}  // namespace phantom::dds
