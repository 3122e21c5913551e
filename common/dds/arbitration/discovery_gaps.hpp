#pragma once

#include <bitset>
#include <cstddef>
#include <mutex>
#include <span>
#include <vector>

#include "common/core/clock.hpp"
#include "common/core/recent_map.hpp"
#include "common/dds/admission/guid_prefix.hpp"
#include "common/wire/message.hpp"

namespace phantom::dds {

/// Finds participants whose announcements of readers and writers do not arrive, although they say by short
/// messages (HEARTBEAT) that they sent them: mostly, the network drops fragments of IP. Of announcements that
/// DDS Security encrypts nothing is seen. Bounded; thread-safe. Real-time safe: no, a new writer takes
/// memory.
class DiscoveryGaps {
 public:
  static constexpr std::size_t kMaxWriters = 512;
  static constexpr std::size_t kMaxSamples = 1024;  ///< of a writer; later ones are not judged

  struct Incomplete {
    GuidPrefix participant{};
    core::Nanoseconds since = 0;  ///< since when something is missing
  };

  /// Takes what a datagram says of announcements.
  void note(std::span<const wire::DiscoverySequence> sequences, core::Nanoseconds now);
  /// Forgets a participant that has gone or was lost: it will tell everything again.
  void forget(const GuidPrefix& participant);
  /// Returns the participants of which something has been missing since `before` or longer.
  std::vector<Incomplete> incomplete(core::Nanoseconds before) const;

 private:
  struct Writer {
    std::bitset<kMaxSamples> come;  // by number − 1
    std::int64_t first = 1, last = 0;
    core::Nanoseconds incomplete_since = 0;  // 0: complete
  };
  struct Key {
    GuidPrefix participant;
    wire::EntityId writer;
    friend auto operator<=>(const Key&, const Key&) = default;
  };
  static bool complete(const Writer& writer);

  mutable std::mutex mutex_;
  core::RecentMap<Key, Writer> writers_{kMaxWriters};
};

}  // namespace phantom::dds
