#include "common/wire/data.hpp"

#include <algorithm>

namespace phantom::wire {
namespace {

using detail::Submessage;

enum class Topic : std::uint8_t { kParticipants, kEndpoints, kLiveliness, kHandshake };

struct Builtin {
  EntityId writer, reader;
  Topic topic;
};

constexpr Builtin kBuiltins[] = {
    {kParticipantWriter, kParticipantReader, Topic::kParticipants},
    {kSecureParticipantWriter, kSecureParticipantReader, Topic::kParticipants},
    {kTopicWriter, kTopicReader, Topic::kEndpoints},
    {kPublicationWriter, kPublicationReader, Topic::kEndpoints},
    {kSubscriptionWriter, kSubscriptionReader, Topic::kEndpoints},
    {kSecurePublicationWriter, kSecurePublicationReader, Topic::kEndpoints},
    {kSecureSubscriptionWriter, kSecureSubscriptionReader, Topic::kEndpoints},
    {kLivelinessWriter, kLivelinessReader, Topic::kLiveliness},
    {kSecureLivelinessWriter, kSecureLivelinessReader, Topic::kLiveliness},
    {kStatelessWriter, kStatelessReader, Topic::kHandshake},
    {kVolatileWriter, kVolatileReader, Topic::kHandshake},
};

/// Returns the built-in pair to which either end belongs; null: neither does.
const Builtin* builtin_of(EntityId writer, EntityId reader) {
  for (const Builtin& builtin : kBuiltins)
    if (builtin.writer == writer || builtin.reader == reader) return &builtin;
  return nullptr;
}

/// Inline QoS, from the reader's place on.
Fault check_inline_qos(const Submessage& submessage, OctetReader& reader, std::uint16_t vendor,
                       ListFacts& facts) {
  std::size_t length = 0;
  const Fault fault =
      check_parameter_list(submessage.octets.subspan(reader.position()), submessage.little_endian(),
                           ListPlace::kInlineQos, vendor, facts, length);
  if (fault != Fault::kNone) return Fault::kInlineQos;
  reader.skip(length);
  return Fault::kNone;
}

Fault check_liveliness(OctetReader body) {
  body.skip(16);  // participant, kind
  return body.skip(body.u32()) ? Fault::kNone : Fault::kPayload;
}

Fault check_handshake(OctetReader body) {
  body.skip(24 + 24 + 16 + 16 + 16);  // identities, keys
  if (!body.good() || !body.string()) return Fault::kHandshake;
  if (!body.align(4)) return Fault::kHandshake;
  const std::size_t count = body.u32();
  if (!body.good() || count > body.left() / 12) return Fault::kHandshake;
  for (std::size_t i = 0; i < count; ++i)
    if (!check_data_holder(body)) return Fault::kHandshake;
  return Fault::kNone;
}

bool add_participant(const Guid& writer, const ListFacts& list, MessageFacts& facts) {
  if (facts.participant_count == facts.participants.size()) return false;
  const Guid announced =
      list.key.value_or(list.participant.value_or(Guid{writer.prefix, kParticipantEntity}));
  facts.participants[facts.participant_count++] = {announced.prefix, writer.prefix, list.lease_s,
                                                   (list.status & 3) != 0, list.listens};
  return true;
}

bool add_endpoint(const Guid& writer, const ListFacts& list, MessageFacts& facts) {
  if (facts.endpoint_count == facts.endpoints.size()) return false;
  facts.endpoints[facts.endpoint_count++] = {list.key.value_or(list.endpoint.value_or(writer)),
                                             (list.status & 3) != 0};
  return true;
}

Fault add(Topic topic, const Guid& writer, const ListFacts& list, MessageFacts& facts) {
  const bool fits = topic == Topic::kParticipants ? add_participant(writer, list, facts)
                    : topic == Topic::kEndpoints  ? add_endpoint(writer, list, facts)
                                                  : true;
  return fits ? Fault::kNone : Fault::kSubmessage;
}

/// A built-in sample's payload; `inline_list` is what its inline QoS says.
Fault check_payload(const Builtin& builtin, const Guid& writer, std::span<std::uint8_t> payload,
                    bool key_only, const ListFacts& inline_list, MessageFacts& facts) {
  if (payload.size() < kEncapsulation) return Fault::kPayload;
  const std::uint16_t kind = static_cast<std::uint16_t>(payload[0] << 8 | payload[1]);
  const bool little_endian = (kind & 1) != 0;
  const std::span<std::uint8_t> body = payload.subspan(kEncapsulation);
  if (builtin.topic == Topic::kLiveliness || builtin.topic == Topic::kHandshake) {
    if (kind > 1) return Fault::kPayload;  // plain CDR
    if (key_only) return Fault::kNone;
    if (builtin.topic == Topic::kLiveliness) return check_liveliness(OctetReader(body, little_endian));
    facts.handshake = true;
    return check_handshake(OctetReader(body, little_endian));
  }
  if (kind != 2 && kind != 3) return Fault::kPayload;  // a parameter list
  ListFacts list = inline_list;
  std::size_t length = 0;
  const Fault fault = check_parameter_list(
      body, little_endian, facts.described ? ListPlace::kDescribedDiscovery : ListPlace::kDiscovery,
      facts.vendor, list, length);
  if (fault != Fault::kNone) return fault;
  list.status |= inline_list.status;
  if (builtin.topic == Topic::kParticipants && facts.unchecked_leases && !list.lease.empty())
    write_lease(list.lease, kUncheckedLease_s, little_endian);
  return add(builtin.topic, writer, list, facts);
}

/// DATA and DATA_FRAG share their beginning: flags, offset to inline QoS, endpoints, sequence number. Reads
/// up to where inline QoS begins.
struct DataHead {
  EntityId reader = 0;
  Guid writer;
  std::int64_t sequence = 0;
  const Builtin* builtin = nullptr;
};

Fault read_head(OctetReader& reader, const GuidPrefix& sender, DataHead& head, std::size_t& inline_qos_at) {
  reader.u16();  // extra flags
  const std::uint16_t offset = reader.u16();
  inline_qos_at = reader.position() + offset;
  head.reader = reader.entity();
  head.writer = {sender, reader.entity()};
  head.sequence = reader.i64_as_two();
  if (!reader.good()) return Fault::kSubmessage;
  if (head.sequence < 1) return Fault::kSequence;
  head.builtin = builtin_of(head.writer.entity, head.reader);
  if (head.builtin != nullptr && (head.builtin->writer != head.writer.entity ||
                                  (head.reader != 0 && head.builtin->reader != head.reader)))
    return Fault::kEndpoint;
  return Fault::kNone;
}

bool skip_to(OctetReader& reader, std::size_t position) {
  return position >= reader.position() && reader.skip(position - reader.position());
}

/// Fast DDS keeps the list of missing fragments in the sample's own memory: at the start of each missing
/// fragment, at the next multiple of 4, it writes 4 octets. They must not lie beyond what the allocator
/// rounds the sample's size up to, and no two of them in one place.
bool list_fits(std::uint32_t sample_bytes, std::uint32_t fragment_bytes, std::uint64_t fragments) {
  if (fragment_bytes < 4) return false;
  const std::uint64_t last = ((fragments - 1) * fragment_bytes + 3) / 4 * 4;
  return last + 4 <= (std::uint64_t{sample_bytes} + 3) / 4 * 4;
}

}  // namespace

Fault detail::check_data(const Submessage& submessage, const GuidPrefix& sender, MessageFacts& facts) {
  OctetReader reader = submessage.reader();
  DataHead head;
  std::size_t inline_qos_at = 0;
  if (const Fault fault = read_head(reader, sender, head, inline_qos_at); fault != Fault::kNone) return fault;
  const bool data = submessage.flag(2), key = submessage.flag(3);
  if ((data && key) || !skip_to(reader, inline_qos_at)) return Fault::kPayload;
  ListFacts list;
  if (submessage.flag(1)) {
    if (const Fault fault = check_inline_qos(submessage, reader, facts.vendor, list); fault != Fault::kNone)
      return fault;
  }
  const std::span<std::uint8_t> payload = submessage.octets.subspan(reader.position());
  facts.note_discovery({head.writer, head.sequence, head.sequence, false});
  if (!data && !key)
    return head.builtin != nullptr ? add(head.builtin->topic, head.writer, list, facts) : Fault::kNone;
  if (payload.empty()) return Fault::kPayload;
  if (head.builtin != nullptr) return check_payload(*head.builtin, head.writer, payload, key, list, facts);
  return key || payload.size() >= kEncapsulation ? Fault::kNone : Fault::kPayload;
}

Fault detail::check_data_frag(const Submessage& submessage, const GuidPrefix& sender, MessageFacts& facts) {
  OctetReader reader = submessage.reader();
  DataHead head;
  std::size_t inline_qos_at = 0;
  if (const Fault fault = read_head(reader, sender, head, inline_qos_at); fault != Fault::kNone) return fault;
  FragmentFact fact{.writer = head.writer, .reader = head.reader, .sequence = head.sequence};
  fact.first = reader.u32();
  fact.count = reader.u16();
  fact.fragment_bytes = reader.u16();
  fact.sample_bytes = reader.u32();
  if (!reader.good() || !skip_to(reader, inline_qos_at)) return Fault::kSubmessage;
  ListFacts list;
  if (submessage.flag(1)) {
    if (const Fault fault = check_inline_qos(submessage, reader, facts.vendor, list); fault != Fault::kNone)
      return fault;
  }
  if (submessage.flag(2)) return Fault::kFragment;  // a key in fragments: nobody has one so long
  if (fact.first < 1 || fact.count < 1 || fact.fragment_bytes < 1 || fact.sample_bytes < 1)
    return Fault::kFragment;
  const std::uint64_t fragments =
      (std::uint64_t{fact.sample_bytes} + fact.fragment_bytes - 1) / fact.fragment_bytes;
  const std::uint64_t before = fact.first - 1, upto = before + fact.count;
  if (upto > fragments || !list_fits(fact.sample_bytes, fact.fragment_bytes, fragments))
    return Fault::kFragment;
  const std::uint64_t carried =
      std::min<std::uint64_t>(upto * fact.fragment_bytes, fact.sample_bytes) - before * fact.fragment_bytes;
  // What follows the fragments is padding to a multiple of four.
  if (reader.left() < carried || reader.left() - carried > 3) return Fault::kFragment;
  fact.at = submessage.at + reader.position();
  fact.size = static_cast<std::size_t>(carried);
  fact.place = submessage.place();
  fact.built_in = head.builtin != nullptr;
  if (facts.fragment_count == facts.fragments.size()) return Fault::kSubmessage;
  facts.fragments[facts.fragment_count++] = fact;
  facts.note_discovery({head.writer, head.sequence, head.sequence, false});
  return Fault::kNone;
}

}  // namespace phantom::wire
