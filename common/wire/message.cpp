#include "common/wire/message.hpp"

#include <algorithm>

#include "common/wire/octets.hpp"

namespace phantom::wire {
namespace {

constexpr std::uint32_t kMostBits = 256;
constexpr std::size_t kCryptoHeader = 20, kMac = 16, kReceiverMac = 20;

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

enum class Topic : std::uint8_t { kUser, kParticipants, kEndpoints, kLiveliness, kHandshake };

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

/// A set of numbers from `base` on, of 256 at most (9.4.2.6, 9.4.2.8). An empty one may have any base: Fast
/// DDS sends base 0 before it knows a writer.
bool number_set(OctetReader& reader, std::int64_t base) {
  const std::uint32_t bits = reader.u32();
  return reader.good() && bits <= kMostBits && (base >= 1 || (base == 0 && bits == 0)) &&
         reader.skip((bits + 31) / 32 * 4);
}

Fault check_acknack(OctetReader reader) {
  reader.skip(8);
  const std::int64_t base = reader.i64_as_two();
  if (!reader.good()) return Fault::kSubmessage;
  if (!number_set(reader, base)) return Fault::kNumberSet;
  reader.u32();  // count
  return reader.good() ? Fault::kNone : Fault::kSubmessage;
}

Fault add_sequence(const SequenceFact& fact, MessageFacts& facts) {
  if (facts.sequence_count == facts.sequences.size()) return Fault::kSubmessage;
  facts.sequences[facts.sequence_count++] = fact;
  return Fault::kNone;
}

Fault check_heartbeat(const Submessage& submessage, const GuidPrefix& sender, MessageFacts& facts) {
  OctetReader reader = submessage.reader();
  reader.skip(4);
  const Guid writer{sender, reader.entity()};
  const std::int64_t first = reader.i64_as_two(), last = reader.i64_as_two();
  reader.u32();  // count
  if (!reader.good()) return Fault::kSubmessage;
  if (first < 1 || last < first - 1) return Fault::kSequence;
  return add_sequence({.writer = writer, .first = first, .place = submessage.place()}, facts);
}

Fault check_gap(const Submessage& submessage, const GuidPrefix& sender, MessageFacts& facts) {
  OctetReader reader = submessage.reader();
  reader.skip(4);
  const Guid writer{sender, reader.entity()};
  const std::int64_t start = reader.i64_as_two(), base = reader.i64_as_two();
  if (!reader.good()) return Fault::kSubmessage;
  if (start < 1 || base < 1) return Fault::kSequence;
  if (base > start && base - start > kLongestGap) return Fault::kSequence;
  const std::size_t before = reader.left();
  if (!number_set(reader, base)) return Fault::kNumberSet;
  const auto listed = static_cast<std::int64_t>(8 * (before - reader.left()));
  const std::int64_t missing = std::max<std::int64_t>(base - start, 0) + listed;
  return add_sequence(
      {.writer = writer, .missing = static_cast<std::uint32_t>(missing), .place = submessage.place()}, facts);
}

Fault check_nack_frag(OctetReader reader) {
  reader.skip(8);
  if (reader.i64_as_two() < 1 && reader.good()) return Fault::kSequence;
  const std::uint32_t base = reader.u32();
  if (!reader.good()) return Fault::kSubmessage;
  if (!number_set(reader, base)) return Fault::kNumberSet;
  reader.u32();  // count
  return reader.good() ? Fault::kNone : Fault::kSubmessage;
}

Fault check_heartbeat_frag(OctetReader reader) {
  reader.skip(8);
  const std::int64_t sequence = reader.i64_as_two();
  reader.skip(8);  // last fragment, count
  if (!reader.good()) return Fault::kSubmessage;
  return sequence >= 1 ? Fault::kNone : Fault::kSequence;
}

Fault check_info_reply(OctetReader reader, bool multicast) {
  for (int list = 0; list < (multicast ? 2 : 1); ++list) {
    const std::size_t count = reader.u32();
    if (!reader.good() || count > reader.left() / 24 || !reader.skip(count * 24)) return Fault::kSubmessage;
  }
  return Fault::kNone;
}

Fault need(const OctetReader& reader, std::size_t octets) {
  return reader.left() >= octets ? Fault::kNone : Fault::kSubmessage;
}

Fault check_secure_body(OctetReader reader) {
  OctetReader content(reader.take(reader.left()), false);  // DDS Security 1.1, 9.5.2.4: big-endian
  const std::size_t length = content.u32();
  return content.good() && length > 0 && length <= content.left() ? Fault::kNone : Fault::kSecured;
}

Fault check_secure_postfix(OctetReader reader) {
  OctetReader footer(reader.take(reader.left()), false);
  footer.skip(kMac);
  const std::size_t count = footer.u32();
  return footer.good() && count <= footer.left() / kReceiverMac ? Fault::kNone : Fault::kSecured;
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

Fault check_data(const Submessage& submessage, const GuidPrefix& sender, MessageFacts& facts) {
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
  if (!data && !key)
    return head.builtin != nullptr ? add(head.builtin->topic, head.writer, list, facts) : Fault::kNone;
  if (payload.empty()) return Fault::kPayload;
  if (head.builtin != nullptr) return check_payload(*head.builtin, head.writer, payload, key, list, facts);
  return key || payload.size() >= kEncapsulation ? Fault::kNone : Fault::kPayload;
}

/// Fast DDS keeps the list of missing fragments in the sample's own memory: at the start of each missing
/// fragment, at the next multiple of 4, it writes 4 octets. They must not lie beyond what the allocator
/// rounds the sample's size up to, and no two of them in one place.
bool list_fits(std::uint32_t sample_bytes, std::uint32_t fragment_bytes, std::uint64_t fragments) {
  if (fragment_bytes < 4) return false;
  const std::uint64_t last = ((fragments - 1) * fragment_bytes + 3) / 4 * 4;
  return last + 4 <= (std::uint64_t{sample_bytes} + 3) / 4 * 4;
}

Fault check_data_frag(const Submessage& submessage, const GuidPrefix& sender, MessageFacts& facts) {
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
  return Fault::kNone;
}

Fault check_info_source(OctetReader reader, GuidPrefix& sender, MessageFacts& facts) {
  if (reader.left() != 20) return Fault::kSubmessage;
  reader.skip(8);  // unused, version, vendor
  const auto prefix = reader.take(sender.size());
  std::copy(prefix.begin(), prefix.end(), sender.begin());
  facts.for_another = facts.for_another || sender != facts.sender;
  return Fault::kNone;
}

Fault check_submessage(const Submessage& submessage, GuidPrefix& sender, MessageFacts& facts) {
  const OctetReader reader = submessage.reader();
  switch (submessage.id) {
    case SubmessageId::kAckNack:
      return check_acknack(reader);
    case SubmessageId::kHeartbeat:
      return check_heartbeat(submessage, sender, facts);
    case SubmessageId::kGap:
      return check_gap(submessage, sender, facts);
    case SubmessageId::kInfoTimestamp:
      return submessage.flag(1) ? Fault::kNone : need(reader, 8);
    case SubmessageId::kInfoSource:
      return check_info_source(reader, sender, facts);
    case SubmessageId::kInfoDestination:
      return need(reader, sender.size());
    case SubmessageId::kInfoReply:
      return check_info_reply(reader, submessage.flag(1));
    case SubmessageId::kInfoReplyIp4:
      return need(reader, submessage.flag(1) ? 16 : 8);
    case SubmessageId::kNackFrag:
      return check_nack_frag(reader);
    case SubmessageId::kHeartbeatFrag:
      return check_heartbeat_frag(reader);
    case SubmessageId::kData:
      return check_data(submessage, sender, facts);
    case SubmessageId::kDataFrag:
      return check_data_frag(submessage, sender, facts);
    case SubmessageId::kSecureBody:
      return check_secure_body(reader);
    case SubmessageId::kSecurePrefix:
    case SubmessageId::kSecureRtpsPrefix:
      return reader.left() >= kCryptoHeader ? Fault::kNone : Fault::kSecured;
    case SubmessageId::kSecurePostfix:
    case SubmessageId::kSecureRtpsPostfix:
      return check_secure_postfix(reader);
    case SubmessageId::kPad:
      return Fault::kNone;
  }
  return Fault::kNone;  // a later version's or a vendor's own: it is skipped by its length
}

bool is_secure(SubmessageId id) {
  return id >= SubmessageId::kSecureBody && id <= SubmessageId::kSecureRtpsPostfix;
}

/// The order of secured submessages: a prefix, one submessage, a postfix; around all of a message its own
/// prefix, first, and postfix. Behind that may follow what is not covered and no standard knows: Fast DDS
/// appends its own statistics to a signed message.
class SecureFrame {
 public:
  bool admits(SubmessageId id, bool first) {
    if (ended_) return id >= kFirstOfVendors;
    switch (id) {
      case SubmessageId::kSecureRtpsPrefix:
        return first && (message_ = true);
      case SubmessageId::kSecureRtpsPostfix:
        return message_ && within_ == 0 && (ended_ = true);
      case SubmessageId::kSecurePrefix:
        return within_ == 0 && ++within_ == 1;
      case SubmessageId::kSecurePostfix:
        if (within_ != 2) return false;
        within_ = 0;
        return true;
      case SubmessageId::kSecureBody:
        return within_ == 1 ? ++within_ == 2 : message_ && within_ == 0;
      default:
        return within_ == 0 || ++within_ == 2;
    }
  }
  /// True for a submessage that was just admitted and stands in a frame.
  bool inside() const { return message_ || within_ != 0; }
  bool closed() const { return within_ == 0 && message_ == ended_; }

 private:
  bool message_ = false, ended_ = false;
  int within_ = 0;  // 1 after a prefix, 2 after what it covers
};

Fault check_header(std::span<const std::uint8_t> datagram, MessageFacts& facts) {
  constexpr std::uint8_t kMagic[] = {'R', 'T', 'P', 'S', 2};
  if (datagram.size() < kHeaderBytes || !std::equal(std::begin(kMagic), std::end(kMagic), datagram.begin()))
    return Fault::kHeader;
  facts.vendor = static_cast<std::uint16_t>(datagram[6] << 8 | datagram[7]);
  std::copy_n(datagram.begin() + 8, facts.sender.size(), facts.sender.begin());
  return Fault::kNone;
}

}  // namespace

bool MessageFacts::of_discovery() const {
  return participant_count > 0 || endpoint_count > 0 || handshake ||
         std::any_of(fragments.begin(), fragments.begin() + static_cast<std::ptrdiff_t>(fragment_count),
                     [](const FragmentFact& fragment) { return fragment.built_in; });
}

Fault check_builtin_payload(const Guid& writer, EntityId reader, std::span<std::uint8_t> payload,
                            std::uint32_t status, bool key_only, MessageFacts& facts) {
  const Builtin* builtin = builtin_of(writer.entity, reader);
  if (builtin == nullptr) return Fault::kEndpoint;
  ListFacts list;
  list.status = status;
  return check_payload(*builtin, writer, payload, key_only, list, facts);
}

Fault check_message(std::span<std::uint8_t> datagram, const Receiver& receiver, MessageFacts& facts) {
  facts.participant_count = facts.endpoint_count = facts.fragment_count = facts.sequence_count = 0;
  facts.handshake = facts.for_another = false;
  facts.described = receiver.asks_for_types;
  if (const Fault fault = check_header(datagram, facts); fault != Fault::kNone) return fault;
  GuidPrefix sender = facts.sender;
  SecureFrame frame;
  std::size_t at = kHeaderBytes;
  while (at < datagram.size()) {
    if (datagram.size() - at < kSubmessageHeader) return Fault::kSubmessage;
    Submessage submessage{
        static_cast<SubmessageId>(datagram[at]), datagram[at + 1], at + kSubmessageHeader, {}};
    const std::uint8_t low = datagram[at + (submessage.little_endian() ? 2 : 3)],
                       high = datagram[at + (submessage.little_endian() ? 3 : 2)];
    std::size_t length = static_cast<std::size_t>(high << 8 | low);
    const std::size_t left = datagram.size() - submessage.at;
    // The last one may say 0 for "up to the end"; these two may be empty.
    if (length == 0 && submessage.id != SubmessageId::kPad && submessage.id != SubmessageId::kInfoTimestamp)
      length = left;
    if (length > left || (length % 4 != 0 && length != left)) return Fault::kSubmessage;
    submessage.octets = datagram.subspan(submessage.at, length);
    if (!frame.admits(submessage.id, at == kHeaderBytes)) return Fault::kSecured;
    const bool sealed = receiver.secured && frame.inside() && !is_secure(submessage.id);
    if (const Fault fault = sealed ? Fault::kNone : check_submessage(submessage, sender, facts);
        fault != Fault::kNone)
      return fault;
    at = submessage.at + length;
  }
  return frame.closed() ? Fault::kNone : Fault::kSecured;
}

}  // namespace phantom::wire
