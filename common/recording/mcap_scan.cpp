// Reads a file without a usable summary: from the beginning, record by record, up to the first incomplete
// record.

#include <algorithm>

#include "common/recording/compression.hpp"
#include "common/recording/mcap_reader.hpp"

namespace phantom::recording {

void McapReader::scan() {
  Bytes bytes;
  std::uint64_t offset = data_begin_;
  const std::uint64_t size = source_->size();
  while (offset < size) {
    std::uint64_t length = 0;
    bool whole = source_->read(offset, kRecordHeadBytes, bytes).is_ok();
    Opcode opcode{};
    if (whole) {
      opcode = static_cast<Opcode>(bytes[0]);
      for (std::size_t i = 0; i < 8; ++i) length |= static_cast<std::uint64_t>(bytes[1 + i]) << (8 * i);
      whole = opcode != Opcode{} && length <= limits_.record_bytes &&
              source_->read(offset + kRecordHeadBytes, length, bytes).is_ok();
    }
    if (!whole) {
      problems_.push_back("it ends in the middle of a record: " + std::to_string(size - offset) +
                          " bytes from byte " + std::to_string(offset) + " on cannot be read");
      break;
    }
    if (!scan_record(opcode, offset, bytes)) break;
    offset += kRecordHeadBytes + length;
  }
  statistics_.schema_count = static_cast<std::uint16_t>(schemas_.size());
  statistics_.channel_count = static_cast<std::uint32_t>(channels_.size());
}

/// Takes one record into account. Returns false at the end of the data.
bool McapReader::scan_record(Opcode opcode, std::uint64_t offset, ByteView content) {
  const std::uint64_t length = kRecordHeadBytes + content.size();
  const auto damaged = [&](const char* what) {
    problems_.push_back("byte " + std::to_string(offset) + ": " + what + " is damaged and left out");
  };
  Schema schema;
  Channel channel;
  Message message;
  Metadata metadata;
  Attachment attachment;
  switch (opcode) {
    case Opcode::kSchema:
      if (!parse(content, schema)) return damaged("a schema"), true;
      schemas_[schema.id] = std::move(schema);
      return true;
    case Opcode::kChannel:
      if (!parse(content, channel)) return damaged("a channel"), true;
      channels_[channel.id] = std::move(channel);
      return true;
    case Opcode::kChunk:
      scan_chunk(offset, content);
      return true;
    case Opcode::kMessage: {
      if (!parse(content, message)) return damaged("a message"), true;
      scan_message(message);
      MessageBlock* last = blocks_.empty() ? nullptr : &blocks_.back();
      if (last == nullptr || last->is_chunk || last->offset + last->length != offset)
        last =
            &blocks_.emplace_back(MessageBlock{offset, 0, message.log_time_ns, message.log_time_ns, false});
      last->length += length;
      last->start_ns = std::min(last->start_ns, message.log_time_ns);
      last->end_ns = std::max(last->end_ns, message.log_time_ns);
      return true;
    }
    case Opcode::kMetadata:
      if (!parse(content, metadata)) return damaged("metadata"), true;
      metadata_indexes_.push_back({offset, length, metadata.name});
      ++statistics_.metadata_count;
      return true;
    case Opcode::kAttachment:
      if (!parse(content, attachment)) return damaged("an attachment"), true;
      attachment_indexes_.push_back({offset, length, attachment.log_time_ns, attachment.create_time_ns,
                                     attachment.data.size(), attachment.name, attachment.media_type});
      ++statistics_.attachment_count;
      return true;
    case Opcode::kDataEnd:
    case Opcode::kFooter:
      return false;
    default:
      return true;  // indexes, and kinds of records newer than this reader
  }
}

void McapReader::scan_chunk(std::uint64_t offset, ByteView content) {
  Chunk chunk;
  Bytes buffer;
  const bool parsed = parse(content, chunk);
  auto records = parsed ? decompressed(chunk, limits_.chunk_bytes, buffer)
                        : core::Expected<ByteView>(core::Status::invalid_argument("a chunk is damaged"));
  if (!records) {
    problems_.push_back("byte " + std::to_string(offset) + ": " + records.status().message() +
                        "; its messages are left out");
    return;
  }
  ++statistics_.chunk_count;
  blocks_.push_back({offset, kRecordHeadBytes + content.size(), chunk.message_start_time_ns,
                     chunk.message_end_time_ns, true});
  RecordView view;
  for (ByteView left = *records; next_record(left, view); left = left.subspan(view.size())) {
    Schema schema;
    Channel channel;
    Message message;
    if (view.opcode == Opcode::kSchema && parse(view.content, schema))
      schemas_[schema.id] = std::move(schema);
    if (view.opcode == Opcode::kChannel && parse(view.content, channel))
      channels_[channel.id] = std::move(channel);
    if (view.opcode == Opcode::kMessage && parse(view.content, message)) scan_message(message);
  }
}

void McapReader::scan_message(const Message& message) {
  const bool first = statistics_.message_count++ == 0;
  ++statistics_.channel_message_counts[message.channel_id];
  statistics_.message_start_time_ns =
      first ? message.log_time_ns : std::min(statistics_.message_start_time_ns, message.log_time_ns);
  statistics_.message_end_time_ns = std::max(statistics_.message_end_time_ns, message.log_time_ns);
}

}  // namespace phantom::recording
