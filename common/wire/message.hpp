#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/wire/fault.hpp"
#include "common/wire/parameter_list.hpp"
#include "common/wire/rtps.hpp"

namespace phantom::wire {

/// A participant's announcement or departure (the SPDP topic).
struct ParticipantFact {
  GuidPrefix announced{};  ///< whom the data speaks of
  GuidPrefix sender{};     ///< who sends it
  double lease_s = 0.0;
  bool departs = false;
  Source listens{};  ///< where it takes announcements; port 0: not said
};

/// One announced endpoint (the SEDP topics).
struct EndpointFact {
  Guid endpoint;
  bool departs = false;
};

/// Where a submessage lies in the datagram.
struct Place {
  std::size_t begin = 0, end = 0;  ///< from its header on
  bool little_endian = true;
};

/// Fragments of one sample in one submessage.
struct FragmentFact {
  Guid writer;
  EntityId reader = 0;
  std::int64_t sequence = 0;
  std::uint32_t first = 1, count = 1;  ///< numbers of the fragments, from 1
  std::uint32_t sample_bytes = 0;
  std::uint16_t fragment_bytes = 0;
  std::size_t at = 0, size = 0;  ///< the fragments' octets in the datagram
  Place place;
  bool built_in = false;  ///< of a built-in writer: the guard assembles it
};

/// What makes a reader of Fast DDS count through a writer's sequence numbers: a HEARTBEAT or a GAP.
struct SequenceFact {
  Guid writer;
  std::int64_t first = 0;     ///< a HEARTBEAT's: the first sample that the writer still has; 0: a GAP
  std::uint32_t missing = 0;  ///< a GAP's: how many numbers it declares missing, at most
  /// A GAP's: all numbers from start to before base, and some from there to before end.
  std::int64_t start = 0, base = 0, end = 0;
  Place place;
};

/// What a writer that announces endpoints says of its samples.
struct DiscoverySequence {
  Guid writer;
  std::int64_t first = 0, last = 0;  ///< numbers of the samples
  bool announced = false;            ///< a HEARTBEAT's: it has them; else they have come, or never will (GAP)
};

/// What the state of the guard depends on, of one datagram. More than the limits: Fault::kSubmessage. It is
/// large: keep one for each thread that receives.
struct MessageFacts {
  static constexpr std::size_t kMax = 128;
  GuidPrefix sender{};  ///< of the header
  std::uint16_t vendor = 0;
  std::array<ParticipantFact, 64> participants;
  std::array<EndpointFact, kMax> endpoints;
  std::array<FragmentFact, kMax> fragments;
  std::array<SequenceFact, kMax> sequences;
  std::array<DiscoverySequence, kMax> discovery;
  std::size_t participant_count = 0, endpoint_count = 0, fragment_count = 0, sequence_count = 0,
              discovery_count = 0;
  bool handshake = false;         ///< holds a message of the security handshake
  bool described = false;         ///< the receiver asks for descriptions of types
  bool unchecked_leases = false;  ///< Fast DDS is to check no lease of a participant
  bool for_another = false;       ///< INFO_SRC lets a part of it speak for another participant than `sender`

  /// Takes numbers of `writer`, if that announces readers or writers in the clear. What is beyond kMax is
  /// left out: nothing but a report depends on it.
  void note_discovery(const DiscoverySequence& sequence) {
    const EntityId entity = sequence.writer.entity;
    if ((entity == kPublicationWriter || entity == kSubscriptionWriter) && discovery_count < kMax)
      discovery[discovery_count++] = sequence;
  }
  /// Returns whether any of it is discovery's or a handshake's, whatever port it came in by.
  bool of_discovery() const;
};

/// The participant that a message is for.
struct Receiver {
  bool secured = false;         ///< decodes secured submessages
  bool asks_for_types = false;  ///< asks others to describe their types, so that it reads what they announce
  /// Fast DDS reads kUncheckedLease_s in place of every participant's lease.
  bool unchecked_leases = false;
};

/// Greatest span of one GAP. Fast DDS walks through it number by number.
inline constexpr std::int64_t kMaxGap = 1 << 22;

/// Checks one RTPS message, the whole content of a datagram, before Fast DDS parses it (OMG DDSI-RTPS 2.5,
/// 8.3.4 to 8.3.8, 9.4; DDS Security 1.1, 7.3.6): header, each submessage's length against the datagram, each
/// one's own fields, inline QoS, discovery data and handshakes. Kinds that are unknown or a vendor's own are
/// passed if they fit. Encrypted parts are checked in their outer form. Discovery data may be changed in
/// place (check_parameter_list).
///
/// What stands in a secured submessage or message is not looked into and not changed for a participant that
/// decodes it: Fast DDS reads it only if its signature is right. A participant without security would read it
/// as if the frame were not there, and so does this function.
///
/// Returns kNone and fills `facts`, or the first fault. Real-time safe: yes; at most one pass over the
/// octets.
Fault check_message(std::span<std::uint8_t> datagram, const Receiver& receiver, MessageFacts& facts);

}  // namespace phantom::wire
