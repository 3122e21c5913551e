#pragma once

#include <algorithm>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/wire/rtps.hpp"

namespace phantom::wire::test {

/// Octets put together by hand, little-endian or big-endian.
class Octets {
 public:
  Octets() : Octets(true) {}
  explicit Octets(bool little_endian) : little_(little_endian) {}

  Octets& u8(std::initializer_list<int> octets) {
    for (const int octet : octets) bytes.push_back(static_cast<std::uint8_t>(octet));
    return *this;
  }
  Octets& u16(std::uint32_t value) { return number(value, 2); }
  Octets& u32(std::uint32_t value) { return number(value, 4); }
  Octets& sequence(std::int64_t value) {
    return u32(static_cast<std::uint32_t>(static_cast<std::uint64_t>(value) >> 32))
        .u32(static_cast<std::uint32_t>(value));
  }
  Octets& entity(EntityId id) {
    return u8({static_cast<int>(id >> 24), static_cast<int>(id >> 16 & 0xff),
               static_cast<int>(id >> 8 & 0xff), static_cast<int>(id & 0xff)});
  }
  Octets& guid(const Guid& guid) { return raw(guid.prefix).entity(guid.entity); }
  Octets& raw(std::span<const std::uint8_t> octets) {
    for (const std::uint8_t octet : octets) bytes.push_back(octet);
    return *this;
  }
  Octets& text(std::string_view text) {  // with its length and ending zero, to the next multiple of 4
    u32(static_cast<std::uint32_t>(text.size() + 1));
    for (const char c : text) bytes.push_back(static_cast<std::uint8_t>(c));
    bytes.push_back(0);
    return align();
  }
  Octets& align() {
    while (bytes.size() % 4 != 0) bytes.push_back(0);
    return *this;
  }
  Octets& parameter(Pid pid, const Octets& value) {
    return u16(static_cast<std::uint32_t>(pid))
        .u16(static_cast<std::uint32_t>(value.bytes.size()))
        .raw(value.bytes);
  }
  Octets& sentinel() { return u16(1).u16(0); }
  bool little_endian() const { return little_; }

  std::vector<std::uint8_t> bytes;

 private:
  Octets& number(std::uint32_t value, int size) {
    for (int i = 0; i < size; ++i)
      bytes.push_back(static_cast<std::uint8_t>(value >> 8 * (little_ ? i : size - 1 - i)));
    return *this;
  }
  bool little_;
};

inline constexpr GuidPrefix kPeer = {1, 15, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11};

inline GuidPrefix peer(int number) {
  GuidPrefix prefix = kPeer;
  prefix[10] = static_cast<std::uint8_t>(number >> 8);
  prefix[11] = static_cast<std::uint8_t>(number);
  return prefix;
}

inline std::vector<std::uint8_t> header(const GuidPrefix& prefix = kPeer,
                                        std::uint16_t vendor = kVendorFastDds) {
  return Octets().u8({'R', 'T', 'P', 'S', 2, 3, vendor >> 8, vendor & 0xff}).raw(prefix).bytes;
}

inline std::vector<std::uint8_t> submessage(SubmessageId id, int flags, const Octets& fields) {
  return Octets(fields.little_endian())
      .u8({static_cast<int>(id), flags | (fields.little_endian() ? 1 : 0)})
      .u16(static_cast<std::uint32_t>(fields.bytes.size()))
      .raw(fields.bytes)
      .bytes;
}

inline std::vector<std::uint8_t> message(std::initializer_list<std::vector<std::uint8_t>> submessages,
                                         const GuidPrefix& prefix = kPeer,
                                         std::uint16_t vendor = kVendorFastDds) {
  std::vector<std::uint8_t> whole = header(prefix, vendor);
  for (const auto& one : submessages) whole.insert(whole.end(), one.begin(), one.end());
  return whole;
}

/// Fields of a DATA; `inline_qos` and `payload` may be empty.
inline Octets data_fields(EntityId reader, EntityId writer, std::int64_t sequence, const Octets& inline_qos,
                          const Octets& payload, bool little_endian = true) {
  return Octets(little_endian)
      .u16(0)
      .u16(16)
      .entity(reader)
      .entity(writer)
      .sequence(sequence)
      .raw(inline_qos.bytes)
      .raw(payload.bytes);
}

/// A parameter list with its encapsulation, little-endian.
inline Octets encapsulated(const Octets& list) {
  return Octets(list.little_endian()).u8({0, list.little_endian() ? 3 : 2, 0, 0}).raw(list.bytes);
}

inline Octets locator(std::uint32_t address, std::uint32_t port) {
  return Octets().u32(1).u32(port).u32(0).u32(0).u32(0).entity(address);
}

/// What a participant announces of itself, without the sentinel.
inline Octets participant_list(const GuidPrefix& prefix = kPeer, std::uint32_t lease_s = 20) {
  Octets list;
  list.parameter(Pid::kProtocolVersion, Octets().u8({2, 3, 0, 0}))
      .parameter(Pid::kVendorId, Octets().u8({1, 15, 0, 0}))
      .parameter(Pid::kParticipantGuid, Octets().guid({prefix, kParticipantEntity}))
      .parameter(Pid::kMetatrafficUnicastLocator, locator(0x7f000001, 7410))
      .parameter(Pid::kDefaultUnicastLocator, locator(0x7f000001, 7411))
      .parameter(Pid::kLeaseDuration, Octets().u32(lease_s).u32(0))
      .parameter(Pid::kBuiltinEndpointSet, Octets().u32(0x3f))
      .parameter(Pid::kEntityName, Octets().text("slave_io"))
      .parameter(Pid::kPropertyList, Octets().u32(1).text("PARTICIPANT_TYPE").text("SIMPLE"));
  return list;
}

inline std::vector<std::uint8_t> announcement(const GuidPrefix& prefix = kPeer, std::uint32_t lease_s = 20) {
  return message({submessage(SubmessageId::kData, 4,
                             data_fields(kParticipantReader, kParticipantWriter, 1, Octets(),
                                         encapsulated(participant_list(prefix, lease_s).sentinel())))},
                 prefix);
}

inline std::vector<std::uint8_t> departure(const GuidPrefix& prefix = kPeer) {
  const Octets qos = Octets()
                         .parameter(Pid::kKeyHash, Octets().guid({prefix, kParticipantEntity}))
                         .parameter(Pid::kStatusInfo, Octets().u8({0, 0, 0, 3}))
                         .sentinel();
  return message({submessage(SubmessageId::kData, 2,
                             data_fields(kParticipantReader, kParticipantWriter, 2, qos, Octets()))},
                 prefix);
}

inline Octets endpoint_list(const Guid& endpoint) {
  Octets list;
  list.parameter(Pid::kEndpointGuid, Octets().guid(endpoint))
      .parameter(Pid::kParticipantGuid, Octets().guid({endpoint.prefix, kParticipantEntity}))
      .parameter(Pid::kTopicName, Octets().text("slave_state"))
      .parameter(Pid::kTypeName, Octets().text("phantom::msg::SlaveState"))
      .parameter(Pid::kReliability, Octets().u32(1).u32(0).u32(0))
      .parameter(Pid::kLiveliness, Octets().u32(0).u32(1).u32(0))
      .parameter(Pid::kPartition, Octets().u32(2).text("hall").text("cell_7"))
      .parameter(Pid::kUserData, Octets().u32(5).u8({1, 2, 3, 4, 5}).align())
      .parameter(Pid::kDataRepresentation, Octets().u32(1).u16(0).u16(0));
  return list;
}

inline std::vector<std::uint8_t> endpoint_announcement(const Guid& endpoint, std::int64_t sequence = 1) {
  return message({submessage(SubmessageId::kData, 4,
                             data_fields(kPublicationReader, kPublicationWriter, sequence, Octets(),
                                         encapsulated(endpoint_list(endpoint).sentinel())))},
                 endpoint.prefix);
}

/// A message of the security handshake, an initiator's first one, that says it has `holders` holders of data
/// and has one.
inline Octets handshake_payload(std::uint32_t holders = 1) {
  Octets payload = Octets().u8({0, 1, 0, 0});
  for (int i = 0; i < 96; ++i) payload.u8({i});
  payload.text("dds.sec.auth").u32(holders);
  return payload.text("DDS:Auth:PKI-DH:1.0+Req").u32(0).u32(1).text("c.id").u32(8).sequence(1);
}

inline std::vector<std::uint8_t> handshake(const GuidPrefix& prefix = kPeer, std::int64_t sequence = 1) {
  return message(
      {submessage(SubmessageId::kData, 4,
                  data_fields(kStatelessReader, kStatelessWriter, sequence, Octets(), handshake_payload()))},
      prefix);
}

/// A submessage of `octets` encrypted octets in its frame.
inline std::vector<std::uint8_t> sealed(const GuidPrefix& prefix = kPeer, std::uint32_t octets = 8) {
  Octets head, body(false), foot;
  head.bytes.resize(20);  // DDS Security 1.1, 9.5.2.3: kind, key, session, counter
  body.u32(octets);
  body.bytes.resize(4 + octets, 7);
  body.align();
  foot.bytes.resize(20);  // the signature, none for single receivers
  return message(
      {submessage(SubmessageId::kSecurePrefix, 0, head), submessage(SubmessageId::kSecureBody, 0, body),
       submessage(SubmessageId::kSecurePostfix, 0, foot)},
      prefix);
}

inline std::vector<std::uint8_t> heartbeat(const Guid& writer, std::int64_t first, std::int64_t last,
                                           std::uint32_t count = 1) {
  const auto fields = Octets().entity(0).entity(writer.entity).sequence(first).sequence(last).u32(count);
  return message({submessage(SubmessageId::kHeartbeat, 0, fields)}, writer.prefix);
}

/// Declares the numbers from `start` to before `base` missing.
inline std::vector<std::uint8_t> gap(const Guid& writer, std::int64_t start, std::int64_t base) {
  const auto fields = Octets().entity(0).entity(writer.entity).sequence(start).sequence(base).u32(0);
  return message({submessage(SubmessageId::kGap, 0, fields)}, writer.prefix);
}

struct Fragments {
  EntityId reader = 0x00000104, writer = 0x00000103;
  std::int64_t sequence = 1;
  std::uint32_t first = 1;
  std::uint32_t count = 1;
  std::uint32_t fragment_bytes = 64;
  std::uint32_t sample_bytes = 128;
  std::size_t carried = 64;
};

inline std::vector<std::uint8_t> fragment_submessage(const Fragments& f,
                                                     std::span<const std::uint8_t> payload = {}) {
  Octets fields;
  fields.u16(0).u16(28).entity(f.reader).entity(f.writer).sequence(f.sequence);
  fields.u32(f.first).u16(f.count).u16(f.fragment_bytes).u32(f.sample_bytes);
  if (payload.empty()) {
    fields.bytes.resize(fields.bytes.size() + f.carried, 7);
  } else {
    fields.raw(payload);
  }
  return submessage(SubmessageId::kDataFrag, 0, fields);
}

}  // namespace phantom::wire::test
