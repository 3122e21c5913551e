#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include "common/core/clock.hpp"
#include "common/wire/message.hpp"

namespace phantom::wire {

/// Puts the fragments of built-in endpoints' samples together: announcements and handshakes that are larger
/// than a datagram of their sender. A few at a time; the one touched longest ago gives way, and its writer
/// sends it again when asked. Memory is taken at construction (and used as it is needed). Real-time safe:
/// yes.
class SampleAssembly {
 public:
  static constexpr std::size_t kSamples = 16;
  static constexpr std::size_t kMaxBytes = 60000;  ///< a sample must fit into one datagram
  static constexpr std::size_t kMaxFragments = 1024;

  SampleAssembly();

  /// Adds a submessage's fragments; `datagram` is the one that `fragment` refers to. Returns the whole
  /// sample's payload if it is complete now, and forgets it; empty: not yet. `refused` becomes true if the
  /// sample is too large or contradicts what came of it before. The payload is valid until the next call.
  std::span<std::uint8_t> add(std::span<const std::uint8_t> datagram, const FragmentFact& fragment,
                              core::Nanoseconds now, bool& refused);

 private:
  struct Sample {
    Guid writer;
    std::int64_t sequence = 0;  // 0: free
    std::uint32_t sample_bytes = 0;
    std::uint16_t fragment_bytes = 0;
    std::size_t missing = 0;
    core::Nanoseconds last = 0;
    std::array<std::uint64_t, kMaxFragments / 64> have{};
  };
  std::size_t place_of(const FragmentFact& fragment, core::Nanoseconds now);

  std::array<Sample, kSamples> samples_;
  std::unique_ptr<std::uint8_t[]> octets_;  // kMaxBytes for each
};

}  // namespace phantom::wire
