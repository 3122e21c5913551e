#include "common/recording/mcap_records.hpp"

#include <zlib.h>

#include <algorithm>
#include <concepts>
#include <tuple>

namespace phantom::recording {
namespace {

/// Overwrites the length field at `at` with the number of bytes that follow it.
template <std::unsigned_integral T>
void set_length(Bytes& out, std::size_t at) {
  const auto length = static_cast<T>(out.size() - at - sizeof(T));
  for (std::size_t i = 0; i < sizeof(T); ++i) out[at + i] = static_cast<std::uint8_t>(length >> (8 * i));
}

// Fields are little-endian; a text, a block of bytes, a list or a map comes after its length in bytes, in 32
// bits. A ByteView takes the rest of the record.
template <std::unsigned_integral T>
void put(Bytes& out, T value) {
  for (std::size_t i = 0; i < sizeof(T); ++i) out.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}
void put(Bytes& out, Opcode opcode) { out.push_back(static_cast<std::uint8_t>(opcode)); }
void put(Bytes& out, ByteView rest) { out.insert(out.end(), rest.begin(), rest.end()); }
template <class Container>
requires requires(const Container& c) { c.begin(); }
void put(Bytes& out, const Container& container) {
  const std::size_t at = out.size();
  put(out, std::uint32_t{0});
  for (const auto& item : container) {
    if constexpr (sizeof item == 1) {
      out.push_back(static_cast<std::uint8_t>(item));
    } else {
      put(out, item.first);
      put(out, item.second);
    }
  }
  set_length<std::uint32_t>(out, at);
}

/// Reads fields in sequence. After a missing field, every further field reads as empty and ok() returns
/// false.
class Fields {
 public:
  explicit Fields(ByteView bytes) : left_(bytes) {}
  bool ok() const { return ok_; }
  ByteView rest() const { return left_; }

  ByteView take(std::uint64_t count) {
    ok_ = ok_ && count <= left_.size();
    const ByteView taken = left_.first(ok_ ? static_cast<std::size_t>(count) : 0);
    left_ = ok_ ? left_.subspan(taken.size()) : ByteView();
    return taken;
  }
  template <std::unsigned_integral T>
  T number() {
    T value = 0;
    const ByteView bytes = take(sizeof(T));
    for (std::size_t i = 0; i < bytes.size(); ++i)
      value = static_cast<T>(value | static_cast<T>(bytes[i]) << (8 * i));
    return value;
  }
  void get(std::unsigned_integral auto& value) { value = number<std::remove_reference_t<decltype(value)>>(); }
  void get(Opcode& opcode) { opcode = static_cast<Opcode>(number<std::uint8_t>()); }
  void get(ByteView& rest) { rest = left_; }
  template <class Container>
  void get(Container& container) {
    container.clear();
    Fields entries(take(number<std::uint32_t>()));
    if constexpr (sizeof(typename Container::value_type) == 1) {
      container.assign(entries.left_.begin(), entries.left_.end());
    } else {
      while (!entries.left_.empty()) {
        std::pair<std::remove_const_t<typename Container::value_type::first_type>,
                  typename Container::value_type::second_type>
            entry{};
        entries.get(entry.first);
        entries.get(entry.second);
        if (!entries.ok_) break;
        if constexpr (requires { container.insert_or_assign(entry.first, entry.second); }) {
          container.insert_or_assign(std::move(entry.first), std::move(entry.second));
        } else {
          container.push_back(entry);
        }
      }
      ok_ = ok_ && entries.ok_;
    }
  }

 private:
  ByteView left_;
  bool ok_ = true;
};

template <class Given, class Record>
concept Is = std::is_same_v<std::remove_const_t<Given>, Record>;

// A record's fields in the order of the file, for writing and reading. Chunk and Attachment go on after them.
auto layout(Is<Header> auto& r) { return std::tie(r.profile, r.library); }
auto layout(Is<Footer> auto& r) { return std::tie(r.summary_start, r.summary_offset_start, r.summary_crc); }
auto layout(Is<Schema> auto& r) { return std::tie(r.id, r.name, r.encoding, r.data); }
auto layout(Is<Channel> auto& r) {
  return std::tie(r.id, r.schema_id, r.topic, r.message_encoding, r.metadata);
}
auto layout(Is<Message> auto& r) {
  return std::tie(r.channel_id, r.sequence, r.log_time_ns, r.publish_time_ns, r.data);
}
auto layout(Is<Chunk> auto& r) {
  return std::tie(r.message_start_time_ns, r.message_end_time_ns, r.uncompressed_size, r.uncompressed_crc,
                  r.compression);
}
auto layout(Is<MessageIndex> auto& r) { return std::tie(r.channel_id, r.records); }
auto layout(Is<ChunkIndex> auto& r) {
  return std::tie(r.message_start_time_ns, r.message_end_time_ns, r.chunk_start_offset, r.chunk_length,
                  r.message_index_offsets, r.message_index_length, r.compression, r.compressed_size,
                  r.uncompressed_size);
}
auto layout(Is<Attachment> auto& r) {
  return std::tie(r.log_time_ns, r.create_time_ns, r.name, r.media_type);
}
auto layout(Is<AttachmentIndex> auto& r) {
  return std::tie(r.offset, r.length, r.log_time_ns, r.create_time_ns, r.data_size, r.name, r.media_type);
}
auto layout(Is<Statistics> auto& r) {
  return std::tie(r.message_count, r.schema_count, r.channel_count, r.attachment_count, r.metadata_count,
                  r.chunk_count, r.message_start_time_ns, r.message_end_time_ns, r.channel_message_counts);
}
auto layout(Is<Metadata> auto& r) { return std::tie(r.name, r.metadata); }
auto layout(Is<MetadataIndex> auto& r) { return std::tie(r.offset, r.length, r.name); }
auto layout(Is<SummaryOffset> auto& r) { return std::tie(r.group_opcode, r.group_start, r.group_length); }
auto layout(Is<DataEnd> auto& r) { return std::tie(r.data_section_crc); }

}  // namespace

template <class Record>
void append(Bytes& out, const Record& record) {
  put(out, Record::kOpcode);
  const std::size_t length_at = out.size();
  put(out, std::uint64_t{0});
  const std::size_t begin = out.size();
  std::apply([&](const auto&... field) { (put(out, field), ...); }, layout(record));
  if constexpr (std::is_same_v<Record, Chunk>) {
    put(out, std::uint64_t{record.records.size()});
    put(out, record.records);
  } else if constexpr (std::is_same_v<Record, Attachment>) {
    put(out, std::uint64_t{record.data.size()});
    put(out, ByteView(record.data));
    put(out, crc32(ByteView(out).subspan(begin)));
  }
  set_length<std::uint64_t>(out, length_at);
}

template <class Record>
bool parse(ByteView content, Record& record) {
  Fields fields(content);
  std::apply([&](auto&... field) { (fields.get(field), ...); }, layout(record));
  if constexpr (std::is_same_v<Record, Chunk>) {
    record.records = fields.take(fields.number<std::uint64_t>());
  } else if constexpr (std::is_same_v<Record, Attachment>) {
    const ByteView data = fields.take(fields.number<std::uint64_t>());
    record.data.assign(data.begin(), data.end());
    const ByteView covered = content.first(content.size() - fields.rest().size());
    const auto crc = fields.number<std::uint32_t>();
    if (fields.ok() && crc != 0 && crc != crc32(covered)) return false;
  }
  return fields.ok();
}

#define PHANTOM_INSTANTIATE(Record)            \
  template void append(Bytes&, const Record&); \
  template bool parse(ByteView, Record&);
PHANTOM_INSTANTIATE(Header)
PHANTOM_INSTANTIATE(Footer)
PHANTOM_INSTANTIATE(Schema)
PHANTOM_INSTANTIATE(Channel)
PHANTOM_INSTANTIATE(Message)
PHANTOM_INSTANTIATE(Chunk)
PHANTOM_INSTANTIATE(MessageIndex)
PHANTOM_INSTANTIATE(ChunkIndex)
PHANTOM_INSTANTIATE(Attachment)
PHANTOM_INSTANTIATE(AttachmentIndex)
PHANTOM_INSTANTIATE(Statistics)
PHANTOM_INSTANTIATE(Metadata)
PHANTOM_INSTANTIATE(MetadataIndex)
PHANTOM_INSTANTIATE(SummaryOffset)
PHANTOM_INSTANTIATE(DataEnd)
#undef PHANTOM_INSTANTIATE

void Statistics::count(std::uint16_t channel_id, std::uint64_t log_time_ns) {
  const bool first = message_count++ == 0;
  ++channel_message_counts[channel_id];
  message_start_time_ns = first ? log_time_ns : std::min(message_start_time_ns, log_time_ns);
  message_end_time_ns = std::max(message_end_time_ns, log_time_ns);
}

bool next_record(ByteView bytes, RecordView& record) {
  Fields fields(bytes);
  fields.get(record.opcode);
  record.content = fields.take(fields.number<std::uint64_t>());
  return fields.ok();
}

std::uint64_t content_length(ByteView head) { return Fields(head.subspan(1)).number<std::uint64_t>(); }

std::uint32_t crc32(ByteView bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(crc32_z(before, bytes.data(), bytes.size()));
}

}  // namespace phantom::recording
