#pragma once

#include <cstdint>
#include <vector>

#include "common/dds/admission/handshake_watch.hpp"

namespace phantom::dds {

/// Greater than an announcement's sequence number, which counts how often its content has changed. A peer
/// forgets the number together with the participant.
inline constexpr std::uint32_t kDepartureSequence = 1 << 20;

/// Returns the RTPS message by which participant `own` takes leave of `peer` alone: the disposal of its own
/// announcement (OMG DDSI-RTPS, Simple Participant Discovery Protocol: DATA with KeyHash and StatusInfo), as
/// a participant that ends sends it to all. `peer` forgets `own`, and discovers it again at its next
/// announcement. `sequence` must be greater than those of the announcements.
std::vector<std::uint8_t> departure(const GuidPrefix& own, const GuidPrefix& peer, std::uint32_t sequence);

}  // namespace phantom::dds
