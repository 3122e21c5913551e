#include "common/wire/message.hpp"

#include <algorithm>

#include "common/wire/data.hpp"

namespace phantom::wire {
namespace {

using detail::Submessage;

constexpr std::uint32_t kMaxBits = 256;
constexpr std::size_t kCryptoHeader = 20, kMac = 16, kReceiverMac = 20;

/// A set of numbers from `base` on, of 256 at most (9.4.2.6, 9.4.2.8). An empty one may have any base: Fast
/// DDS sends base 0 before it knows a writer.
bool number_set(OctetReader& reader, std::int64_t base) {
  const std::uint32_t bits = reader.u32();
  return reader.good() && bits <= kMaxBits && (base >= 1 || (base == 0 && bits == 0)) &&
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
  facts.note_discovery({writer, first, last, true});
  return add_sequence({.writer = writer, .first = first, .place = submessage.place()}, facts);
}

Fault check_gap(const Submessage& submessage, const GuidPrefix& sender, MessageFacts& facts) {
  OctetReader reader = submessage.reader();
  reader.skip(4);
  const Guid writer{sender, reader.entity()};
  const std::int64_t start = reader.i64_as_two(), base = reader.i64_as_two();
  if (!reader.good()) return Fault::kSubmessage;
  if (start < 1 || base < 1) return Fault::kSequence;
  if (base > start && base - start > kMaxGap) return Fault::kSequence;
  const std::size_t before = reader.left();
  if (!number_set(reader, base)) return Fault::kNumberSet;
  constexpr std::int64_t kCountBits = 32;  // of the set: how many bits follow
  const auto listed = static_cast<std::int64_t>(8 * (before - reader.left())) - kCountBits;
  const std::int64_t missing = std::max<std::int64_t>(base - start, 0) + listed,
                     end = std::max(base, start) + listed;
  facts.note_discovery({writer, start, end - 1, false});
  return add_sequence({.writer = writer,
                       .missing = static_cast<std::uint32_t>(missing),
                       .start = start,
                       .base = std::max(base, start),
                       .end = end,
                       .place = submessage.place()},
                      facts);
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
      return detail::check_data(submessage, sender, facts);
    case SubmessageId::kDataFrag:
      return detail::check_data_frag(submessage, sender, facts);
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

Fault check_message(std::span<std::uint8_t> datagram, const Receiver& receiver, MessageFacts& facts) {
  facts.participant_count = facts.endpoint_count = facts.fragment_count = facts.sequence_count = 0;
  facts.discovery_count = 0;
  facts.handshake = facts.for_another = false;
  facts.described = receiver.asks_for_types;
  facts.unchecked_leases = receiver.unchecked_leases;
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
