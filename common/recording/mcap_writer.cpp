#include "common/recording/mcap_writer.hpp"

#include <algorithm>
#include <limits>

namespace phantom::recording {
namespace {

constexpr std::size_t kMaxIds = std::numeric_limits<std::uint16_t>::max();

core::Status too_many(const char* what) {
  return {core::ErrorCode::kResourceExhausted,
          std::string("a file holds at most ") + std::to_string(kMaxIds) + " " + what};
}

}  // namespace

McapWriter::McapWriter(ByteSink& sink, const WriterOptions& options) : sink_(sink), options_(options) {
  if (options_.zstd_level != 0) compressor_.emplace(options_.zstd_level);
  Bytes begin(kMagic.begin(), kMagic.end());
  append(begin, Header{options_.profile, options_.library});
  (void)put_bytes(begin);
}

core::Status McapWriter::put_bytes(ByteView bytes) {
  if (!status_) return status_;
  if (finished_) return {core::ErrorCode::kFailedPrecondition, "the recording has been finished"};
  status_ = sink_.write(bytes);
  if (!status_) return status_;
  offset_ += bytes.size();
  data_crc_ = crc32(bytes, data_crc_);
  return {};
}

template <class Record>
core::Status McapWriter::put_record(const Record& record) {
  buffer_.clear();
  append(buffer_, record);
  return put_bytes(buffer_);
}

core::Expected<std::uint16_t> McapWriter::add_schema(Schema record) {
  if (schemas_.size() == kMaxIds) return too_many("schemas");
  record.id = static_cast<std::uint16_t>(schemas_.size() + 1);
  if (core::Status status = put_record(record); !status) return status;
  schemas_.push_back(std::move(record));
  ++statistics_.schema_count;
  return schemas_.back().id;
}

core::Expected<std::uint16_t> McapWriter::add_channel(Channel record) {
  if (channels_.size() == kMaxIds) return too_many("channels");
  if (record.schema_id > schemas_.size())
    return core::Status::invalid_argument("channel " + record.topic +
                                          " names a schema that is not in the file");
  record.id = static_cast<std::uint16_t>(channels_.size());
  if (core::Status status = put_record(record); !status) return status;
  channels_.push_back(std::move(record));
  ++statistics_.channel_count;
  return channels_.back().id;
}

core::Status McapWriter::write(const Message& message) {
  if (!status_) return status_;
  if (message.channel_id >= channels_.size())
    return core::Status::invalid_argument("a message names a channel that is not in the file");
  const bool first = chunk_messages_.empty();
  chunk_start_ns_ = first ? message.log_time_ns : std::min(chunk_start_ns_, message.log_time_ns);
  chunk_end_ns_ = first ? message.log_time_ns : std::max(chunk_end_ns_, message.log_time_ns);
  MessageIndex& index = chunk_messages_[message.channel_id];
  index.channel_id = message.channel_id;
  index.records.emplace_back(message.log_time_ns, chunk_.size());
  append(chunk_, message);
  return chunk_.size() >= options_.chunk_bytes ? end_chunk() : core::Status();
}

core::Status McapWriter::end_chunk() {
  if (!status_ || chunk_messages_.empty()) return status_;
  Chunk chunk{chunk_start_ns_, chunk_end_ns_, chunk_.size(), crc32(chunk_), "", chunk_};
  if (compressor_) {
    if (core::Status status = compressor_->compress(chunk_, compressed_); !status) return status_ = status;
    chunk.compression = "zstd";
    chunk.records = compressed_;
  }
  ChunkIndex index{chunk_start_ns_,   chunk_end_ns_,        offset_,      0, {}, 0,
                   chunk.compression, chunk.records.size(), chunk_.size()};
  buffer_.clear();
  append(buffer_, chunk);
  index.chunk_length = buffer_.size();
  for (auto& [channel, messages] : chunk_messages_) {
    std::stable_sort(messages.records.begin(), messages.records.end());
    index.message_index_offsets[channel] = offset_ + buffer_.size();
    append(buffer_, messages);
  }
  index.message_index_length = buffer_.size() - index.chunk_length;
  // The sink takes a chunk and its indexes together or not at all.
  if (core::Status status = put_bytes(buffer_); !status) return status;

  const bool first = statistics_.message_count == 0;
  statistics_.message_start_time_ns =
      first ? chunk_start_ns_ : std::min(statistics_.message_start_time_ns, chunk_start_ns_);
  statistics_.message_end_time_ns = std::max(statistics_.message_end_time_ns, chunk_end_ns_);
  ++statistics_.chunk_count;
  for (const auto& [channel, messages] : chunk_messages_) {
    statistics_.message_count += messages.records.size();
    statistics_.channel_message_counts[channel] += messages.records.size();
  }
  chunk_indexes_.push_back(std::move(index));
  chunk_messages_.clear();
  chunk_.clear();
  return {};
}

core::Status McapWriter::write(const Metadata& metadata) {
  const std::uint64_t at = offset_;
  if (core::Status status = put_record(metadata); !status) return status;
  metadata_indexes_.push_back({at, offset_ - at, metadata.name});
  ++statistics_.metadata_count;
  return {};
}

core::Status McapWriter::write(const Attachment& attachment) {
  const std::uint64_t at = offset_;
  if (core::Status status = put_record(attachment); !status) return status;
  attachment_indexes_.push_back({at, offset_ - at, attachment.log_time_ns, attachment.create_time_ns,
                                 attachment.data.size(), attachment.name, attachment.media_type});
  ++statistics_.attachment_count;
  return {};
}

/// Appends summary, summary offsets, footer and magic, as they follow at `offset_`.
void McapWriter::put_summary(Bytes& out) {
  std::vector<SummaryOffset> groups;
  const auto put_group = [&](Opcode opcode, const auto& records) {
    const std::size_t begin = out.size();
    for (const auto& record : records) append(out, record);
    if (out.size() > begin) groups.push_back({opcode, offset_ + begin, out.size() - begin});
  };
  put_group(Opcode::kSchema, schemas_);
  put_group(Opcode::kChannel, channels_);
  put_group(Opcode::kStatistics, std::array{statistics_});
  put_group(Opcode::kChunkIndex, chunk_indexes_);
  put_group(Opcode::kAttachmentIndex, attachment_indexes_);
  put_group(Opcode::kMetadataIndex, metadata_indexes_);
  Footer footer{offset_, offset_ + out.size(), 0};
  for (const SummaryOffset& group : groups) append(out, group);
  const std::size_t footer_at = out.size();
  append(out, footer);
  footer.summary_crc = crc32(ByteView(out).first(out.size() - sizeof footer.summary_crc));
  out.resize(footer_at);
  append(out, footer);
  out.insert(out.end(), kMagic.begin(), kMagic.end());
}

core::Status McapWriter::finish() {
  if (finished_) return status_;
  if (core::Status status = end_chunk(); !status) return status;
  if (core::Status status = put_record(DataEnd{data_crc_}); !status) return status;
  Bytes summary;
  put_summary(summary);
  const core::Status status = put_bytes(summary);
  finished_ = true;
  return status;
}

}  // namespace phantom::recording
