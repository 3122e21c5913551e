#include "common/recording/mcap_check.hpp"

#include <algorithm>
#include <tuple>

#include "common/recording/compression.hpp"

namespace phantom::recording {
namespace {

constexpr std::size_t kMaxProblems = 100;

/// One pass over the data section. At the end it compares the result with the summary (from the reader).
class Walk {
 public:
  explicit Walk(const McapReader& reader) : reader_(reader) { report_.bytes = reader.source().size(); }
  CheckReport run();

 private:
  void problem(std::uint64_t offset, const std::string& what) {
    if (report_.problems.size() < kMaxProblems)
      report_.problems.push_back("byte " + std::to_string(offset) + ": " + what);
  }
  template <class Record>
  bool read(std::uint64_t offset, ByteView content, Record& record, const std::string& name) {
    if (parse(content, record)) return true;
    problem(offset, name + " is damaged");
    return false;
  }
  bool visit(std::uint64_t offset, Opcode opcode, ByteView content);
  void chunk(std::uint64_t offset, ByteView content);
  void message_index(std::uint64_t offset, ByteView content);
  bool record(std::uint64_t offset, Opcode opcode, ByteView content, const std::string& where,
              Message& sample);
  void message(std::uint64_t offset, const Message& message);
  void indexes_are_complete();
  void schema(std::uint64_t offset, const Schema& schema);
  void channel(std::uint64_t offset, const Channel& channel);
  void compare_with_summary();

  const McapReader& reader_;
  CheckReport report_;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  Statistics counted_;
  std::uint32_t crc_ = 0;
  std::uint64_t data_end_ = 0;  // offset behind the DataEnd record; 0: none
  // The last chunk, and its messages that no index has named yet: (channel, time, offset).
  std::uint64_t chunk_at_ = 0;
  bool indexed_ = false;
  std::vector<std::tuple<std::uint16_t, std::uint64_t, std::uint64_t>> unindexed_;
};

/// Takes a schema, channel or message into account. Returns whether it is a message, which is in `sample`
/// then.
bool Walk::record(std::uint64_t offset, Opcode opcode, ByteView content, const std::string& where,
                  Message& sample) {
  Schema schema_record;
  Channel channel_record;
  if (opcode == Opcode::kSchema && read(offset, content, schema_record, "a schema" + where))
    schema(offset, schema_record);
  if (opcode == Opcode::kChannel && read(offset, content, channel_record, "a channel" + where))
    channel(offset, channel_record);
  if (opcode != Opcode::kMessage || !read(offset, content, sample, "a message" + where)) return false;
  message(offset, sample);
  return true;
}

void Walk::schema(std::uint64_t offset, const Schema& schema) {
  const auto [known, fresh] = schemas_.emplace(schema.id, schema);
  if (schema.id == 0) problem(offset, "a schema has the id 0; allowed: 1 or more");
  if (!fresh && !(known->second == schema))
    problem(offset, "schema " + std::to_string(schema.id) + " is there twice, not the same");
}

void Walk::channel(std::uint64_t offset, const Channel& channel) {
  const auto [known, fresh] = channels_.emplace(channel.id, channel);
  if (!fresh && !(known->second == channel))
    problem(offset, "channel " + channel.topic + " is there twice, not the same");
  if (channel.schema_id != 0 && !schemas_.contains(channel.schema_id))
    problem(offset, "channel " + channel.topic + " names a schema that has not come");
}

void Walk::message(std::uint64_t offset, const Message& message) {
  if (!channels_.contains(message.channel_id)) problem(offset, "a message names a channel that has not come");
  counted_.count(message.channel_id, message.log_time_ns);
}

void Walk::chunk(std::uint64_t offset, ByteView content) {
  Chunk chunk;
  if (!read(offset, content, chunk, "a chunk")) return;
  ++counted_.chunk_count;
  chunk_at_ = offset;
  Bytes buffer;
  const auto records = decompressed(chunk, reader_.limits().chunk_bytes, buffer);
  if (!records) return problem(offset, records.status().message());
  std::uint64_t start_ns = 0, end_ns = 0;
  bool any = false;
  ByteView left = *records;
  for (RecordView view; next_record(left, view); left = left.subspan(view.size())) {
    Message sample;
    if (!record(offset, view.opcode, view.content, " in this chunk", sample)) continue;
    unindexed_.emplace_back(sample.channel_id, sample.log_time_ns, records->size() - left.size());
    start_ns = any ? std::min(start_ns, sample.log_time_ns) : sample.log_time_ns;
    end_ns = std::max(end_ns, sample.log_time_ns);
    any = true;
  }
  if (!left.empty()) problem(offset, "the chunk ends in the middle of a record");
  if (start_ns != chunk.message_start_time_ns || end_ns != chunk.message_end_time_ns)
    problem(offset, "the chunk claims other times than its messages have");
  std::sort(unindexed_.begin(), unindexed_.end());
}

void Walk::message_index(std::uint64_t offset, ByteView content) {
  MessageIndex index;
  if (!read(offset, content, index, "a message index")) return;
  indexed_ = true;
  for (const auto& [time_ns, at] : index.records) {
    const auto found =
        std::find(unindexed_.begin(), unindexed_.end(), std::make_tuple(index.channel_id, time_ns, at));
    if (found == unindexed_.end())
      return problem(offset, "the message index names a message that is not in its chunk");
    unindexed_.erase(found);
  }
}

/// Reports a chunk whose index is incomplete. A chunk without any index is allowed.
void Walk::indexes_are_complete() {
  if (indexed_ && !unindexed_.empty())
    problem(chunk_at_, std::to_string(unindexed_.size()) + " messages of this chunk are in no index");
  unindexed_.clear();
  indexed_ = false;
}

bool Walk::visit(std::uint64_t offset, Opcode opcode, ByteView content) {
  Message sample;
  Metadata metadata;
  Attachment attachment;
  DataEnd end;
  if (opcode != Opcode::kMessageIndex) indexes_are_complete();
  switch (opcode) {
    case Opcode::kSchema:
    case Opcode::kChannel:
    case Opcode::kMessage:
      record(offset, opcode, content, "", sample);
      break;
    case Opcode::kChunk:
      chunk(offset, content);
      break;
    case Opcode::kMessageIndex:
      message_index(offset, content);
      break;
    case Opcode::kMetadata:
      counted_.metadata_count += read(offset, content, metadata, "metadata") ? 1 : 0;
      break;
    case Opcode::kAttachment:
      counted_.attachment_count += read(offset, content, attachment, "an attachment") ? 1 : 0;
      break;
    case Opcode::kDataEnd:
      data_end_ = offset + kRecordHeadBytes + content.size();
      if (read(offset, content, end, "the end of the data") && end.data_section_crc != 0 &&
          end.data_section_crc != crc_)
        problem(offset, "the data are damaged: their checksum does not fit");
      return false;
    case Opcode::kFooter:
      return false;
    default:
      break;
  }
  return true;
}

void Walk::compare_with_summary() {
  const Statistics& stated = reader_.statistics();
  counted_.schema_count = static_cast<std::uint16_t>(schemas_.size());
  counted_.channel_count = static_cast<std::uint32_t>(channels_.size());
  const std::uint64_t end = reader_.source().size();
  if (data_end_ != reader_.summary_start()) problem(end, "the data do not end where the summary begins");
  if (!(stated == counted_)) problem(end, "the summary's statistics are not those of the data");
  if (reader_.channels() != channels_) problem(end, "the summary's channels are not those of the data");
  if (reader_.schemas() != schemas_) problem(end, "the summary's schemas are not those of the data");
}

CheckReport Walk::run() {
  const ByteSource& source = reader_.source();
  Bytes bytes;
  std::uint64_t offset = 0, length = kMagic.size();
  for (bool more = true; more && offset < source.size();) {
    if (offset > 0) {
      if (!source.read(offset, kRecordHeadBytes, bytes)) break;
      length = kRecordHeadBytes + content_length(bytes);
      if (length - kRecordHeadBytes > reader_.limits().record_bytes) break;
    }
    if (!source.read(offset, length, bytes)) break;
    if (offset > 0)
      more = visit(offset, static_cast<Opcode>(bytes[0]), ByteView(bytes).subspan(kRecordHeadBytes));
    crc_ = crc32(bytes, crc_);
    offset += length;
  }
  indexes_are_complete();
  report_.problems.insert(report_.problems.end(), reader_.problems().begin(), reader_.problems().end());
  if (!reader_.complete() && reader_.problems().empty())
    report_.problems.push_back(data_end_ > 0 ? "it has no summary"
                                             : "it was not finished: it has no summary");
  if (reader_.complete()) compare_with_summary();
  report_.messages = counted_.message_count;
  report_.chunks = counted_.chunk_count;
  return std::move(report_);
}

core::Expected<CheckReport> run(core::Expected<McapReader> reader) {
  if (!reader) return reader.status();
  return Walk(*reader).run();
}

}  // namespace

core::Expected<CheckReport> check(const std::filesystem::path& file, ReaderLimits limits) {
  return run(McapReader::open(file, limits));
}

core::Expected<CheckReport> check(std::unique_ptr<ByteSource> source, ReaderLimits limits) {
  return run(McapReader::open(std::move(source), limits));
}

}  // namespace phantom::recording
