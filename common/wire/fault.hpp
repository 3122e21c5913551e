#pragma once

#include <cstddef>
#include <cstdint>

namespace phantom::wire {

/// Why a datagram is refused.
enum class Fault : std::uint8_t {
  kNone,
  // Not well-formed.
  kHeader,         ///< no header of RTPS 2
  kSubmessage,     ///< a submessage does not fit into the datagram, or its own fields do not fit into it
  kNumberSet,      ///< a set of sequence or fragment numbers is malformed
  kSequence,       ///< a sequence number that cannot be
  kInlineQos,      ///< inline QoS is no list of sound parameters
  kPayload,        ///< the payload is missing, or not what its flags say
  kFragment,       ///< fragment numbers, sizes and total contradict each other
  kParameterList,  ///< discovery data is no list of parameters
  kParameter,      ///< a parameter has a wrong size, an open string or a wrong count
  kEndpoint,       ///< a built-in reader is addressed by another writer than its own
  kHandshake,      ///< a message of the security handshake is malformed
  kSecured,        ///< a secured submessage is malformed
  // More than is kept of strangers.
  kSampleSize,    ///< the whole sample is larger than the endpoint carries
  kFragmentSize,  ///< a writer changes its fragment size, or too many writers send fragments
  kParticipants,  ///< too many participants
  kEndpoints,     ///< too many endpoints of one participant
  kRate,          ///< too many messages of discovery or handshakes in this time
  kUnannounced,   ///< too many samples or acknowledgements of senders that have not announced themselves
  kCounting,      ///< sequence numbers through which readers would count for too long
  // Not from where it may come.
  kSource,     ///< the sender is in none of the networks that the topology names
  kStranger,   ///< fragments from a participant that has not announced itself
  kIdentity,   ///< a participant announces another one, or uses an address that is not its own
  kDeparture,  ///< somebody else says that a participant leaves, which then goes on speaking
  kLeft,       ///< a participant that has left, or was lost and returns, until both have forgotten each other
  kFlood,      ///< a participant that has sent more, keys of a topic or bricks, than is kept
};
inline constexpr std::size_t kFaults = static_cast<std::size_t>(Fault::kFlood) + 1;

/// Returns the reason in words, to stand after "refused: " or "refused from: ": at most 50 octets, so that a
/// figure's name in component_status holds it.
const char* words_of(Fault fault) noexcept;

}  // namespace phantom::wire
