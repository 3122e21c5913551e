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
      length = content_length(bytes);
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
  // Parses the record and passes it to `use`; leaves a damaged one out.
  const auto take = [&](auto record, const char* name, auto&& use) {
    if (parse(content, record)) {
      use(record);
    } else {
      problems_.push_back("byte " + std::to_string(offset) + ": " + name + " is damaged and left out");
    }
  };
  switch (opcode) {
    case Opcode::kSchema:
      take(Schema{}, "a schema", [&](Schema& schema) { schemas_[schema.id] = std::move(schema); });
      return true;
    case Opcode::kChannel:
      take(Channel{}, "a channel", [&](Channel& channel) { channels_[channel.id] = std::move(channel); });
      return true;
    case Opcode::kChunk:
      scan_chunk(offset, content);
      return true;
    case Opcode::kMessage:
      take(Message{}, "a message", [&](const Message& message) {
        statistics_.count(message.channel_id, message.log_time_ns);
        if (blocks_.empty() || blocks_.back().is_chunk ||
            blocks_.back().offset + blocks_.back().length != offset)
          blocks_.push_back({offset, 0, message.log_time_ns, message.log_time_ns, false});
        MessageBlock& run = blocks_.back();
        run.length += length;
        run.start_ns = std::min(run.start_ns, message.log_time_ns);
        run.end_ns = std::max(run.end_ns, message.log_time_ns);
      });
      return true;
    case Opcode::kMetadata:
      take(Metadata{}, "metadata", [&](const Metadata& metadata) {
        metadata_indexes_.push_back({offset, length, metadata.name});
        ++statistics_.metadata_count;
      });
      return true;
    case Opcode::kAttachment:
      take(Attachment{}, "an attachment", [&](const Attachment& attachment) {
        attachment_indexes_.push_back({offset, length, attachment.log_time_ns, attachment.create_time_ns,
                                       attachment.data.size(), attachment.name, attachment.media_type});
        ++statistics_.attachment_count;
      });
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
    ++chunks_left_out_;
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
    if (view.opcode == Opcode::kMessage && parse(view.content, message))
      statistics_.count(message.channel_id, message.log_time_ns);
  }
}

}  // namespace phantom::recording
