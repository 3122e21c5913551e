#pragma once

#include <cstdint>
#include <span>

#include "common/wire/rtps.hpp"

namespace phantom::wire {

/// Octets by which a message may grow in as_fragments(): 12 for each DATA, of at least 28 octets.
inline constexpr std::size_t kMostGrown = 65536 / 28 * 12;

/// Answers whether a writer sends (or has sent) samples in fragments. `of`: whatever it asks.
struct FragmentingWriters {
  bool (*sends)(void* of, const Guid& writer);
  void* of;
};

/// Copies an RTPS message in which check_message() has found no fault, with each DATA of a writer without
/// keys that sends fragments turned into a DATA_FRAG of one fragment (OMG DDSI-RTPS 2.5, 9.4.5.4
/// and 9.4.5.5). A DATA without data of such a writer says nothing to a reader, and becomes padding. Topics
/// with keys are left as they are: a DATA that disposes of an instance has no form in fragments. `into` has
/// room for the message and kMostGrown more. Returns the octets of `into` that were used; none: no submessage
/// is concerned, and the message stays as it is. Real-time safe: yes.
std::span<std::uint8_t> as_fragments(std::span<const std::uint8_t> message, const FragmentingWriters& writers,
                                     std::span<std::uint8_t> into);

}  // namespace phantom::wire
