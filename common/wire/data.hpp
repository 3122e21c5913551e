#pragma once

// Private to this library: DATA and DATA_FRAG, whose payloads are looked into where they are built-in
// writers'.

#include "common/wire/message.hpp"
#include "common/wire/octets.hpp"

namespace phantom::wire::detail {

/// One submessage's fields, after its header.
struct Submessage {
  SubmessageId id{};
  std::uint8_t flags = 0;
  std::size_t at = 0;              // of the fields, in the datagram
  std::span<std::uint8_t> octets;  // the fields
  bool flag(int bit) const { return (flags >> bit & 1) != 0; }
  bool little_endian() const { return (flags & kLittleEndian) != 0; }
  OctetReader reader() const { return {octets, little_endian()}; }
  Place place() const { return {at - kSubmessageHeader, at + octets.size(), little_endian()}; }
};

Fault check_data(const Submessage& submessage, const GuidPrefix& sender, MessageFacts& facts);
Fault check_data_frag(const Submessage& submessage, const GuidPrefix& sender, MessageFacts& facts);

}  // namespace phantom::wire::detail
