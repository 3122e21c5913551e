#include "common/recording/mcap_records.hpp"

#include "common/recording/checksum.hpp"
#include "common/recording/fields.hpp"

namespace phantom::recording {
namespace {

/// Appends a record's head and, at the end of its life, the length of what was put in between.
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

/// Appends a field whose length in bytes stands before it, in 32 bits.
template <class Put>
void put_block(Bytes& out, const Put& put_content) {
  const std::size_t at = out.size();
  put(out, std::uint32_t{0});
  put_content();
  set_length<std::uint32_t>(out, at);
}

void put_map(Bytes& out, const StringMap& map) {
  put_block(out, [&] {
    for (const auto& [key, value] : map) {
      put(out, key);
      put(out, value);
    }
  });
}

void put_map(Bytes& out, const std::map<std::uint16_t, std::uint64_t>& map) {
  put_block(out, [&] {
    for (const auto& [key, value] : map) {
      put(out, key);
      put(out, value);
    }
  });
}

template <class Key, class Value>
bool get_map(Fields& fields, std::map<Key, Value>& map) {
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

}  // namespace

void append(Bytes& out, const Header& record) {
  const Frame frame(out, record.kOpcode);
  put(out, record.profile);
  put(out, record.library);
}

bool parse(ByteView content, Header& record) {
  Fields fields(content);
  fields.get(record.profile);
  fields.get(record.library);
  return fields.ok();
}

void append(Bytes& out, const Footer& record) {
  const Frame frame(out, record.kOpcode);
  put(out, record.summary_start);
  put(out, record.summary_offset_start);
  put(out, record.summary_crc);
}

bool parse(ByteView content, Footer& record) {
  Fields fields(content);
  fields.get(record.summary_start);
  fields.get(record.summary_offset_start);
  fields.get(record.summary_crc);
  return fields.ok();
}

void append(Bytes& out, const Schema& record) {
  const Frame frame(out, record.kOpcode);
  put(out, record.id);
  put(out, record.name);
  put(out, record.encoding);
  put(out, static_cast<std::uint32_t>(record.data.size()));
  put(out, ByteView(record.data));
}

bool parse(ByteView content, Schema& record) {
  Fields fields(content);
  fields.get(record.id);
  fields.get(record.name);
  fields.get(record.encoding);
  const ByteView data = fields.get_block<std::uint32_t>();
  record.data.assign(data.begin(), data.end());
  return fields.ok();
}

void append(Bytes& out, const Channel& record) {
  const Frame frame(out, record.kOpcode);
  put(out, record.id);
  put(out, record.schema_id);
  put(out, record.topic);
  put(out, record.message_encoding);
  put_map(out, record.metadata);
}

bool parse(ByteView content, Channel& record) {
  Fields fields(content);
  fields.get(record.id);
  fields.get(record.schema_id);
  fields.get(record.topic);
  fields.get(record.message_encoding);
  return get_map(fields, record.metadata);
}

void append(Bytes& out, const Message& record) {
  const Frame frame(out, record.kOpcode);
  put(out, record.channel_id);
  put(out, record.sequence);
  put(out, record.log_time_ns);
  put(out, record.publish_time_ns);
  put(out, record.data);
}

bool parse(ByteView content, Message& record) {
  Fields fields(content);
  fields.get(record.channel_id);
  fields.get(record.sequence);
  fields.get(record.log_time_ns);
  fields.get(record.publish_time_ns);
  record.data = fields.rest();
  return fields.ok();
}

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

void append(Bytes& out, const ChunkIndex& record) {
  const Frame frame(out, record.kOpcode);
  put(out, record.message_start_time_ns);
  put(out, record.message_end_time_ns);
  put(out, record.chunk_start_offset);
  put(out, record.chunk_length);
  put_map(out, record.message_index_offsets);
  put(out, record.message_index_length);
  put(out, record.compression);
  put(out, record.compressed_size);
  put(out, record.uncompressed_size);
}

bool parse(ByteView content, ChunkIndex& record) {
  Fields fields(content);
  fields.get(record.message_start_time_ns);
  fields.get(record.message_end_time_ns);
  fields.get(record.chunk_start_offset);
  fields.get(record.chunk_length);
  if (!get_map(fields, record.message_index_offsets)) return false;
  fields.get(record.message_index_length);
  fields.get(record.compression);
  fields.get(record.compressed_size);
  fields.get(record.uncompressed_size);
  return fields.ok();
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

void append(Bytes& out, const AttachmentIndex& record) {
  const Frame frame(out, record.kOpcode);
  put(out, record.offset);
  put(out, record.length);
  put(out, record.log_time_ns);
  put(out, record.create_time_ns);
  put(out, record.data_size);
  put(out, record.name);
  put(out, record.media_type);
}

bool parse(ByteView content, AttachmentIndex& record) {
  Fields fields(content);
  fields.get(record.offset);
  fields.get(record.length);
  fields.get(record.log_time_ns);
  fields.get(record.create_time_ns);
  fields.get(record.data_size);
  fields.get(record.name);
  fields.get(record.media_type);
  return fields.ok();
}

void append(Bytes& out, const Statistics& record) {
  const Frame frame(out, record.kOpcode);
  put(out, record.message_count);
  put(out, record.schema_count);
  put(out, record.channel_count);
  put(out, record.attachment_count);
  put(out, record.metadata_count);
  put(out, record.chunk_count);
  put(out, record.message_start_time_ns);
  put(out, record.message_end_time_ns);
  put_map(out, record.channel_message_counts);
}

bool parse(ByteView content, Statistics& record) {
  Fields fields(content);
  fields.get(record.message_count);
  fields.get(record.schema_count);
  fields.get(record.channel_count);
  fields.get(record.attachment_count);
  fields.get(record.metadata_count);
  fields.get(record.chunk_count);
  fields.get(record.message_start_time_ns);
  fields.get(record.message_end_time_ns);
  return get_map(fields, record.channel_message_counts);
}

void append(Bytes& out, const Metadata& record) {
  const Frame frame(out, record.kOpcode);
  put(out, record.name);
  put_map(out, record.metadata);
}

bool parse(ByteView content, Metadata& record) {
  Fields fields(content);
  fields.get(record.name);
  return get_map(fields, record.metadata);
}

void append(Bytes& out, const MetadataIndex& record) {
  const Frame frame(out, record.kOpcode);
  put(out, record.offset);
  put(out, record.length);
  put(out, record.name);
}

bool parse(ByteView content, MetadataIndex& record) {
  Fields fields(content);
  fields.get(record.offset);
  fields.get(record.length);
  fields.get(record.name);
  return fields.ok();
}

void append(Bytes& out, const SummaryOffset& record) {
  const Frame frame(out, record.kOpcode);
  put(out, static_cast<std::uint8_t>(record.group_opcode));
  put(out, record.group_start);
  put(out, record.group_length);
}

bool parse(ByteView content, SummaryOffset& record) {
  Fields fields(content);
  std::uint8_t opcode = 0;
  fields.get(opcode);
  record.group_opcode = static_cast<Opcode>(opcode);
  fields.get(record.group_start);
  fields.get(record.group_length);
  return fields.ok();
}

void append(Bytes& out, const DataEnd& record) {
  const Frame frame(out, record.kOpcode);
  put(out, record.data_section_crc);
}

bool parse(ByteView content, DataEnd& record) {
  Fields fields(content);
  fields.get(record.data_section_crc);
  return fields.ok();
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
