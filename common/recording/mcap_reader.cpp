#include "common/recording/mcap_reader.hpp"

#include <algorithm>

#include "common/recording/compression.hpp"

namespace phantom::recording {
namespace {

constexpr std::uint64_t kFooterBytes = kRecordHeadBytes + 8 + 8 + 4;

std::string at_byte(std::uint64_t offset) { return "byte " + std::to_string(offset) + ": "; }

bool is_magic(ByteView bytes) {
  return bytes.size() >= kMagic.size() && std::equal(kMagic.begin(), kMagic.end(), bytes.begin());
}

}  // namespace

core::Expected<McapReader> McapReader::open(const std::filesystem::path& file, ReaderLimits limits) {
  auto source = FileSource::open(file);
  if (!source) return source.status();
  auto reader = open(std::move(source).value(), limits);
  if (!reader) return core::Status(reader.status().code(), file.string() + ": " + reader.status().message());
  return reader;
}

core::Expected<McapReader> McapReader::open(std::unique_ptr<ByteSource> source, ReaderLimits limits) {
  McapReader reader(std::move(source), limits);
  if (core::Status status = reader.read_beginning(); !status) return status;
  reader.complete_ = reader.read_summary();
  if (!reader.complete_) reader.scan();
  std::stable_sort(reader.blocks_.begin(), reader.blocks_.end(),
                   [](const MessageBlock& a, const MessageBlock& b) { return a.start_ns < b.start_ns; });
  return reader;
}

core::Status McapReader::read_beginning() {
  Bytes bytes;
  if (!source_->read(0, kMagic.size(), bytes) || !is_magic(bytes))
    return core::Status::invalid_argument("is not an MCAP file: it does not begin as one");
  auto header = core::Expected<Header>(core::Status::invalid_argument("its header is not whole"));
  if (source_->read(kMagic.size(), kRecordHeadBytes, bytes)) {
    const std::uint64_t length = content_length(bytes);
    if (length <= limits_.record_bytes) {
      data_begin_ = kMagic.size() + kRecordHeadBytes + length;
      header = read_record<Header>(kMagic.size(), kRecordHeadBytes + length);
    }
  }
  if (!header) return core::Status::invalid_argument("is not an MCAP file: " + header.status().message());
  header_ = std::move(header).value();
  return {};
}

template <class Record>
core::Expected<Record> McapReader::read_record(std::uint64_t offset, std::uint64_t length) const {
  Bytes bytes;
  RecordView view;
  Record record;
  if (length > limits_.record_bytes)
    return core::Status::invalid_argument(at_byte(offset) + "a record is too long");
  if (core::Status status = source_->read(offset, length, bytes); !status) return status;
  if (!next_record(bytes, view) || view.opcode != Record::kOpcode || !parse(view.content, record))
    return core::Status::invalid_argument(at_byte(offset) + "is not the record that should stand there");
  return record;
}

core::Expected<Metadata> McapReader::read(const MetadataIndex& index) const {
  return read_record<Metadata>(index.offset, index.length);
}

core::Expected<Attachment> McapReader::read(const AttachmentIndex& index) const {
  return read_record<Attachment>(index.offset, index.length);
}

std::vector<StringMap> McapReader::metadata(const std::string& name) const {
  std::vector<StringMap> found;
  for (const MetadataIndex& index : metadata_indexes_) {
    if (index.name != name) continue;
    if (auto metadata = read(index)) found.push_back(std::move(metadata->metadata));
  }
  return found;
}

bool McapReader::read_summary() {
  const std::uint64_t size = source_->size();
  const std::uint64_t end_bytes = kFooterBytes + kMagic.size();
  Bytes bytes;
  if (size < data_begin_ + end_bytes || !source_->read(size - end_bytes, end_bytes, bytes)) return false;
  RecordView view;
  Footer footer;
  if (!is_magic(ByteView(bytes).subspan(kFooterBytes)) || !next_record(bytes, view) ||
      view.opcode != Opcode::kFooter || !parse(view.content, footer))
    return false;
  if (footer.summary_start == 0) return false;
  const std::uint64_t summary_end = size - end_bytes;
  if (footer.summary_start < data_begin_ || footer.summary_start > summary_end ||
      summary_end - footer.summary_start > limits_.record_bytes) {
    problems_.push_back("the footer names a place for the summary that is not in the file");
    return false;
  }
  // The checksum also covers the footer, except for the checksum itself.
  if (!source_->read(footer.summary_start,
                     size - kMagic.size() - sizeof footer.summary_crc - footer.summary_start, bytes))
    return false;
  if (footer.summary_crc != 0 && footer.summary_crc != crc32(bytes)) {
    problems_.push_back("the summary is damaged: its checksum does not fit");
    return false;
  }
  if (parse_summary(ByteView(bytes).first(static_cast<std::size_t>(summary_end - footer.summary_start))) &&
      summary_is_usable()) {
    summary_start_ = footer.summary_start;
    return true;
  }
  schemas_.clear();
  channels_.clear();
  blocks_.clear();
  metadata_indexes_.clear();
  attachment_indexes_.clear();
  statistics_ = {};
  return false;
}

bool McapReader::parse_summary(ByteView summary) {
  const auto keep = [](ByteView content, auto record, auto& list) {
    if (!parse(content, record)) return false;
    list.push_back(std::move(record));
    return true;
  };
  bool ok = true;
  RecordView view;
  for (; ok && next_record(summary, view); summary = summary.subspan(view.size())) {
    Schema schema;
    Channel channel;
    ChunkIndex chunk;
    switch (view.opcode) {
      case Opcode::kSchema:
        ok = parse(view.content, schema);
        schemas_[schema.id] = std::move(schema);
        break;
      case Opcode::kChannel:
        ok = parse(view.content, channel);
        channels_[channel.id] = std::move(channel);
        break;
      case Opcode::kChunkIndex:
        ok = parse(view.content, chunk);
        blocks_.push_back({chunk.chunk_start_offset, chunk.chunk_length, chunk.message_start_time_ns,
                           chunk.message_end_time_ns, true});
        break;
      case Opcode::kStatistics:
        ok = parse(view.content, statistics_);
        break;
      case Opcode::kMetadataIndex:
        ok = keep(view.content, MetadataIndex{}, metadata_indexes_);
        break;
      case Opcode::kAttachmentIndex:
        ok = keep(view.content, AttachmentIndex{}, attachment_indexes_);
        break;
      default:
        break;
    }
  }
  return ok && summary.empty();
}

/// Returns whether the blocks that the summary names are within the file, and are all that its statistics
/// count.
bool McapReader::summary_is_usable() const {
  const std::uint64_t size = source_->size();
  const auto within = [size](std::uint64_t offset, std::uint64_t length) {
    return offset < size && length <= size - offset;
  };
  if (statistics_.message_count > 0 && blocks_.empty()) return false;  // messages outside of chunks
  if (statistics_.chunk_count != blocks_.size()) return false;
  return std::all_of(blocks_.begin(), blocks_.end(),
                     [&](const auto& b) { return within(b.offset, b.length); });
}

core::Expected<ByteView> McapReader::load(const MessageBlock& block, Bytes& raw, Bytes& out) const {
  if (block.length > limits_.record_bytes)
    return core::Status::invalid_argument(at_byte(block.offset) + "a record is too long");
  if (core::Status status = source_->read(block.offset, block.length, raw); !status)
    return core::Status(status.code(), at_byte(block.offset) + status.message());
  if (!block.is_chunk) return ByteView(raw);
  RecordView view;
  Chunk chunk;
  if (!next_record(raw, view) || view.opcode != Opcode::kChunk || !parse(view.content, chunk))
    return core::Status::invalid_argument(at_byte(block.offset) + "is not the chunk that should stand there");
  auto records = decompressed(chunk, limits_.chunk_bytes, out);
  if (!records)
    return core::Status(records.status().code(), at_byte(block.offset) + records.status().message());
  return records;
}

}  // namespace phantom::recording
