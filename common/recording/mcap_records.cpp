#include "common/recording/mcap_records.hpp"

#include <tuple>
#include <type_traits>

#include "common/recording/checksum.hpp"
#include "common/recording/fields.hpp"

namespace phantom::recording {
namespace {

/// Appends a record's head, and on destruction sets its length to the bytes appended since.
class Frame {
 public:
  Frame(Bytes& out, Opcode opcode) : out_(out) {
    out_.push_back(static_cast<std::uint8_t>(opcode));
    length_at_ = out_.size();
    put(out_, std::uint64_t{0});
  }
  ~Frame() { set_length<std::uint64_t>(out_, length_at_); }
  Frame(const Frame&) = delete;
  Frame& operator=(const Frame&) = delete;

 private:
  Bytes& out_;
  std::size_t length_at_;
};

/// Appends a field preceded by its length in bytes, in 32 bits.
template <class Put>
void put_block(Bytes& out, const Put& put_content) {
  const std::size_t at = out.size();
  put(out, std::uint32_t{0});
  put_content();
  set_length<std::uint32_t>(out, at);
}

void put_field(Bytes& out, std::unsigned_integral auto value) { put(out, value); }
void put_field(Bytes& out, const std::string& text) { put(out, text); }
void put_field(Bytes& out, Opcode opcode) { put(out, static_cast<std::uint8_t>(opcode)); }
void put_field(Bytes& out, ByteView rest) { put(out, rest); }
void put_field(Bytes& out, const Bytes& block) {
  put_block(out, [&] { put(out, ByteView(block)); });
}
template <class Key, class Value>
void put_field(Bytes& out, const std::map<Key, Value>& map) {
  put_block(out, [&] {
    for (const auto& [key, value] : map) {
      put(out, key);
      put(out, value);
    }
  });
}

// Each reads a field and returns whether it was complete.
bool get_field(Fields& fields, std::unsigned_integral auto& value) {
  fields.get(value);
  return fields.ok();
}
bool get_field(Fields& fields, std::string& text) {
  fields.get(text);
  return fields.ok();
}
bool get_field(Fields& fields, Opcode& opcode) {
  std::uint8_t value = 0;
  fields.get(value);
  opcode = static_cast<Opcode>(value);
  return fields.ok();
}
bool get_field(Fields& fields, ByteView& rest) {
  rest = fields.rest();
  return fields.ok();
}
bool get_field(Fields& fields, Bytes& block) {
  const ByteView bytes = fields.get_block<std::uint32_t>();
  block.assign(bytes.begin(), bytes.end());
  return fields.ok();
}
template <class Key, class Value>
bool get_field(Fields& fields, std::map<Key, Value>& map) {
  map.clear();
  Fields entries(fields.get_block<std::uint32_t>());
  while (!entries.done()) {
    Key key{};
    Value value{};
    entries.get(key);
    entries.get(value);
    if (!entries.ok()) return false;
    map[std::move(key)] = std::move(value);
  }
  return fields.ok();
}

template <class Given, class Record>
concept Is = std::is_same_v<std::remove_const_t<Given>, Record>;

// A record's fields in the order of the file, for writing and reading. Chunk, MessageIndex and Attachment are
// more complex and have functions of their own.
auto layout(Is<Header> auto& r) { return std::tie(r.profile, r.library); }
auto layout(Is<Footer> auto& r) { return std::tie(r.summary_start, r.summary_offset_start, r.summary_crc); }
auto layout(Is<Schema> auto& r) { return std::tie(r.id, r.name, r.encoding, r.data); }
auto layout(Is<Channel> auto& r) {
  return std::tie(r.id, r.schema_id, r.topic, r.message_encoding, r.metadata);
}
auto layout(Is<Message> auto& r) {
  return std::tie(r.channel_id, r.sequence, r.log_time_ns, r.publish_time_ns, r.data);
}
auto layout(Is<ChunkIndex> auto& r) {
  return std::tie(r.message_start_time_ns, r.message_end_time_ns, r.chunk_start_offset, r.chunk_length,
                  r.message_index_offsets, r.message_index_length, r.compression, r.compressed_size,
                  r.uncompressed_size);
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

template <class Record>
void append_plain(Bytes& out, const Record& record) {
  const Frame frame(out, Record::kOpcode);
  std::apply([&](const auto&... field) { (put_field(out, field), ...); }, layout(record));
}

template <class Record>
bool parse_plain(ByteView content, Record& record) {
  Fields fields(content);
  return std::apply([&](auto&... field) { return (get_field(fields, field) && ...); }, layout(record));
}

}  // namespace

void append(Bytes& out, const Header& record) { append_plain(out, record); }
void append(Bytes& out, const Footer& record) { append_plain(out, record); }
void append(Bytes& out, const Schema& record) { append_plain(out, record); }
void append(Bytes& out, const Channel& record) { append_plain(out, record); }
void append(Bytes& out, const Message& record) { append_plain(out, record); }
void append(Bytes& out, const ChunkIndex& record) { append_plain(out, record); }
void append(Bytes& out, const AttachmentIndex& record) { append_plain(out, record); }
void append(Bytes& out, const Statistics& record) { append_plain(out, record); }
void append(Bytes& out, const Metadata& record) { append_plain(out, record); }
void append(Bytes& out, const MetadataIndex& record) { append_plain(out, record); }
void append(Bytes& out, const SummaryOffset& record) { append_plain(out, record); }
void append(Bytes& out, const DataEnd& record) { append_plain(out, record); }

bool parse(ByteView content, Header& record) { return parse_plain(content, record); }
bool parse(ByteView content, Footer& record) { return parse_plain(content, record); }
bool parse(ByteView content, Schema& record) { return parse_plain(content, record); }
bool parse(ByteView content, Channel& record) { return parse_plain(content, record); }
bool parse(ByteView content, Message& record) { return parse_plain(content, record); }
bool parse(ByteView content, ChunkIndex& record) { return parse_plain(content, record); }
bool parse(ByteView content, AttachmentIndex& record) { return parse_plain(content, record); }
bool parse(ByteView content, Statistics& record) { return parse_plain(content, record); }
bool parse(ByteView content, Metadata& record) { return parse_plain(content, record); }
bool parse(ByteView content, MetadataIndex& record) { return parse_plain(content, record); }
bool parse(ByteView content, SummaryOffset& record) { return parse_plain(content, record); }
bool parse(ByteView content, DataEnd& record) { return parse_plain(content, record); }

void append(Bytes& out, const Chunk& record) {
  const Frame frame(out, record.kOpcode);
  put(out, record.message_start_time_ns);
  put(out, record.message_end_time_ns);
  put(out, record.uncompressed_size);
  put(out, record.uncompressed_crc);
  put(out, record.compression);
  put(out, static_cast<std::uint64_t>(record.records.size()));
  put(out, record.records);
}

bool parse(ByteView content, Chunk& record) {
  Fields fields(content);
  fields.get(record.message_start_time_ns);
  fields.get(record.message_end_time_ns);
  fields.get(record.uncompressed_size);
  fields.get(record.uncompressed_crc);
  fields.get(record.compression);
  record.records = fields.get_block<std::uint64_t>();
  return fields.ok();
}

void append(Bytes& out, const MessageIndex& record) {
  const Frame frame(out, record.kOpcode);
  put(out, record.channel_id);
  put_block(out, [&] {
    for (const auto& [time_ns, offset] : record.records) {
      put(out, time_ns);
      put(out, offset);
    }
  });
}

bool parse(ByteView content, MessageIndex& record) {
  Fields fields(content);
  fields.get(record.channel_id);
  Fields entries(fields.get_block<std::uint32_t>());
  record.records.clear();
  while (!entries.done()) {
    auto& [time_ns, offset] = record.records.emplace_back();
    entries.get(time_ns);
    entries.get(offset);
  }
  return fields.ok() && entries.ok();
}

void append(Bytes& out, const Attachment& record) {
  const Frame frame(out, record.kOpcode);
  const std::size_t begin = out.size();
  put(out, record.log_time_ns);
  put(out, record.create_time_ns);
  put(out, record.name);
  put(out, record.media_type);
  put(out, static_cast<std::uint64_t>(record.data.size()));
  put(out, ByteView(record.data));
  put(out, crc32(ByteView(out).subspan(begin)));
}

bool parse(ByteView content, Attachment& record) {
  Fields fields(content);
  fields.get(record.log_time_ns);
  fields.get(record.create_time_ns);
  fields.get(record.name);
  fields.get(record.media_type);
  const ByteView data = fields.get_block<std::uint64_t>();
  record.data.assign(data.begin(), data.end());
  const std::size_t covered = content.size() - fields.rest().size();
  std::uint32_t crc = 0;
  fields.get(crc);
  return fields.ok() && (crc == 0 || crc == crc32(content.first(covered)));
}

bool next_record(ByteView bytes, RecordView& record) {
  Fields fields(bytes);
  std::uint8_t opcode = 0;
  std::uint64_t length = 0;
  fields.get(opcode);
  fields.get(length);
  record.opcode = static_cast<Opcode>(opcode);
  record.content = fields.take(length);
  return fields.ok();
}

}  // namespace phantom::recording
