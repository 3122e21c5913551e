#include "common/wire/whole_samples.hpp"

#include <algorithm>

#include "common/wire/octets.hpp"

namespace phantom::wire {
namespace {

constexpr std::uint8_t kInlineQos = 0x02, kHoldsData = 0x04;  // flags of a DATA
constexpr std::size_t kDataFields =
    20;  // up to where inline QoS or the payload begins, if nothing is between
constexpr std::size_t kFragmentFields = 12;

/// One submessage of a message that was checked.
struct Part {
  SubmessageId id{};
  std::uint8_t flags = 0;
  std::span<const std::uint8_t> header, fields;
  bool little_endian() const { return (flags & kLittleEndian) != 0; }
};

Part part_at(std::span<const std::uint8_t> message, std::size_t at) {
  Part part{
      static_cast<SubmessageId>(message[at]), message[at + 1], message.subspan(at, kSubmessageHeader), {}};
  OctetReader length_reader(part.header, part.little_endian());
  length_reader.skip(2);
  std::size_t length = length_reader.u16();
  const std::size_t left = message.size() - at - kSubmessageHeader;
  if (length == 0 && part.id != SubmessageId::kPad && part.id != SubmessageId::kInfoTimestamp) length = left;
  part.fields = message.subspan(at + kSubmessageHeader, std::min(length, left));
  return part;
}

class OctetWriter {
 public:
  explicit OctetWriter(std::span<std::uint8_t> into) : into_(into) {}
  void copy(std::span<const std::uint8_t> octets) {
    std::copy(octets.begin(), octets.end(), into_.begin() + static_cast<std::ptrdiff_t>(size_));
    size_ += octets.size();
  }
  void number(std::size_t value, int octets, bool little_endian) {
    for (int i = 0; i < octets; ++i)
      into_[size_++] = static_cast<std::uint8_t>(value >> 8 * (little_endian ? i : octets - 1 - i));
  }
  std::span<std::uint8_t> written() const { return into_.first(size_); }

 private:
  std::span<std::uint8_t> into_;
  std::size_t size_ = 0;
};

/// Where the payload begins, in the fields of a DATA: behind the inline QoS, if there is one.
std::size_t payload_at(const Part& data, std::size_t inline_qos_at) {
  if ((data.flags & kInlineQos) == 0) return inline_qos_at;
  OctetReader list(data.fields, data.little_endian());
  list.skip(inline_qos_at);
  while (list.good()) {
    const auto id = static_cast<Pid>(list.u16());
    const std::size_t length = list.u16();
    if (id == Pid::kSentinel) break;
    list.skip(length);
  }
  return list.position();
}

/// Writes `data` as one fragment of a sample that has no other.
void put_fragment(const Part& data, std::size_t inline_qos_at, OctetWriter& out) {
  const bool little = data.little_endian();
  const std::size_t sample = data.fields.size() - payload_at(data, inline_qos_at);
  out.number(static_cast<std::size_t>(SubmessageId::kDataFrag), 1, little);
  out.number(data.flags & (kLittleEndian | kInlineQos), 1, little);
  out.number(data.fields.size() + kFragmentFields, 2, little);
  out.copy(data.fields.first(2));
  out.number(inline_qos_at - 4 + kFragmentFields, 2, little);
  out.copy(data.fields.subspan(4, kDataFields - 4));
  out.number(1, 4, little);       // the first fragment
  out.number(1, 2, little);       // one of them
  out.number(sample, 2, little);  // its size
  out.number(sample, 4, little);
  out.copy(data.fields.subspan(kDataFields));
}

/// Of a user's writer (DDSI-RTPS 2.5, table 9.1).
bool is_keyless(EntityId writer) { return (writer & 0xff) == 0x03; }

}  // namespace

bool FragmentReassembler::awaits(const GuidPrefix& participant) const {
  return pending_count_ > 0 && std::any_of(pending_.begin(), pending_.end(), [&](const Pending& one) {
           return one.writer && one.writer->prefix == participant;
         });
}

FragmentReassembler::Pending* FragmentReassembler::of(const Guid& writer) {
  if (pending_count_ == 0) return nullptr;
  const auto found = std::find_if(pending_.begin(), pending_.end(),
                                  [&](const Pending& one) { return one.writer && *one.writer == writer; });
  return found == pending_.end() ? nullptr : &*found;
}

void FragmentReassembler::forget(Pending& pending) {
  pending.writer.reset();
  --pending_count_;
}

void FragmentReassembler::note(const Fragment& fragment) {
  Pending* pending = of(fragment.writer);
  if (pending != nullptr && fragment.sequence < pending->sequence) return;  // Fast DDS heeds none of these
  if (pending == nullptr) {
    const auto free =
        std::find_if(pending_.begin(), pending_.end(), [](const Pending& one) { return !one.writer; });
    pending = free != pending_.end() ? &*free : &pending_[next_++ % kMaxWriters];
    if (!pending->writer) ++pending_count_;
    pending->writer = fragment.writer;
    pending->sequence = fragment.sequence - 1;
  }
  if (pending->sequence != fragment.sequence) {
    pending->sequence = fragment.sequence;
    pending->fragments = fragment.fragments;
    pending->heard.reset();
  }
  for (std::size_t i = fragment.first; i < fragment.first + fragment.count && i <= kMaxFragments; ++i)
    pending->heard.set(i - 1);
  if (pending->heard.count() >= pending->fragments) forget(*pending);
}

bool FragmentReassembler::ends_pending(const Guid& writer, std::int64_t sequence) {
  Pending* const pending = of(writer);
  if (pending == nullptr || sequence <= pending->sequence) return false;
  forget(*pending);
  return true;
}

std::span<std::uint8_t> FragmentReassembler::rewrite(std::span<const std::uint8_t> message,
                                                     std::span<std::uint8_t> into) {
  Guid writer;
  std::copy_n(message.begin() + 8, writer.prefix.size(), writer.prefix.begin());
  OctetWriter out(into);
  out.copy(message.first(kHeaderBytes));
  bool changed = false;
  for (std::size_t at = kHeaderBytes; at < message.size();) {
    const Part part = part_at(message, at);
    at += kSubmessageHeader + part.fields.size();
    OctetReader reader(part.fields, part.little_endian());
    if (part.id == SubmessageId::kInfoSource) {
      reader.skip(8);
      const auto prefix = reader.take(writer.prefix.size());
      std::copy(prefix.begin(), prefix.end(), writer.prefix.begin());
    } else if (part.id == SubmessageId::kData || part.id == SubmessageId::kDataFrag) {
      reader.skip(2);
      const std::size_t inline_qos_at = 4u + reader.u16();
      reader.skip(4);
      writer.entity = reader.entity();
      const std::int64_t sequence = reader.i64_as_two();
      if (is_keyless(writer.entity) && part.id == SubmessageId::kDataFrag) {
        Fragment fragment{.writer = writer, .sequence = sequence};
        fragment.first = reader.u32();
        fragment.count = reader.u16();
        const std::size_t fragment_bytes = std::max<std::size_t>(reader.u16(), 1);
        fragment.fragments = (reader.u32() + fragment_bytes - 1) / fragment_bytes;
        note(fragment);
      } else if (is_keyless(writer.entity) && (part.flags & kHoldsData) != 0 &&
                 inline_qos_at >= kDataFields && ends_pending(writer, sequence)) {
        put_fragment(part, inline_qos_at, out);
        changed = true;
        continue;
      }
    }
    out.copy(part.header);
    out.copy(part.fields);
  }
  return changed ? out.written() : std::span<std::uint8_t>();
}

}  // namespace phantom::wire
