#pragma once

#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/recording/byte_source.hpp"
#include "common/recording/mcap_records.hpp"

namespace phantom::recording {

struct ReaderLimits {
  std::uint64_t record_bytes = 1ULL << 30;  ///< a longer record is damage
  std::uint64_t chunk_bytes = 1ULL << 30;   ///< a chunk that decompresses to more is damage
};

/// Where messages lie: a chunk, or a run of messages outside of chunks.
struct MessageBlock {
  std::uint64_t offset = 0, length = 0;
  std::uint64_t start_ns = 0, end_ns = 0;
  bool is_chunk = true;
};

/// An MCAP file, ours or another tool's. Opens by its summary; a file without one (it is still being written,
/// or its writer was killed) or with a damaged one is read from the beginning, record by record, as far as it
/// is whole. Not thread-safe.
class McapReader {
 public:
  /// Fails if it does not begin as an MCAP file.
  static core::Expected<McapReader> open(std::unique_ptr<ByteSource> source, ReaderLimits limits = {});
  static core::Expected<McapReader> open(const std::filesystem::path& file, ReaderLimits limits = {});

  /// Whether it was finished in order. If not, what is there can be read, and problems() says what is not.
  bool complete() const { return complete_; }
  const std::vector<std::string>& problems() const { return problems_; }

  /// Where the summary begins; 0: there is none that can be used.
  std::uint64_t summary_start() const { return summary_start_; }
  const Header& header() const { return header_; }
  const std::map<std::uint16_t, Schema>& schemas() const { return schemas_; }
  const std::map<std::uint16_t, Channel>& channels() const { return channels_; }
  /// As the summary has it; counted, if there is none.
  const Statistics& statistics() const { return statistics_; }
  /// In the order of their first message.
  const std::vector<MessageBlock>& blocks() const { return blocks_; }
  const std::vector<MetadataIndex>& metadata_indexes() const { return metadata_indexes_; }
  const std::vector<AttachmentIndex>& attachment_indexes() const { return attachment_indexes_; }

  core::Expected<Metadata> read(const MetadataIndex& index) const;
  core::Expected<Attachment> read(const AttachmentIndex& index) const;
  /// All metadata of a name, in the order of writing; what cannot be read is left out.
  std::vector<StringMap> metadata(const std::string& name) const;

  /// The records in a block. They point into the buffers.
  core::Expected<ByteView> load(const MessageBlock& block, Bytes& raw, Bytes& decompressed) const;
  const ByteSource& source() const { return *source_; }
  const ReaderLimits& limits() const { return limits_; }

 private:
  McapReader(std::unique_ptr<ByteSource> source, ReaderLimits limits)
      : source_(std::move(source)), limits_(limits) {}
  core::Status read_beginning();
  bool read_summary();
  bool parse_summary(ByteView summary);
  bool summary_is_usable() const;
  void scan();
  bool scan_record(Opcode opcode, std::uint64_t offset, ByteView content);
  void scan_chunk(std::uint64_t offset, ByteView content);
  void scan_message(const Message& message);
  template <class Record>
  core::Expected<Record> read_record(std::uint64_t offset, std::uint64_t length) const;

  std::unique_ptr<ByteSource> source_;
  ReaderLimits limits_;
  bool complete_ = false;
  std::vector<std::string> problems_;
  Header header_;
  std::uint64_t data_begin_ = 0, summary_start_ = 0;
  std::map<std::uint16_t, Schema> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  Statistics statistics_;
  std::vector<MessageBlock> blocks_;
  std::vector<MetadataIndex> metadata_indexes_;
  std::vector<AttachmentIndex> attachment_indexes_;
};

/// Which messages to read.
struct MessageFilter {
  std::function<bool(const Channel&)> channel;                         ///< none: all
  std::uint64_t from_ns = 0;                                           ///< log times from here on …
  std::uint64_t until_ns = std::numeric_limits<std::uint64_t>::max();  ///< … and before this
};

/// Goes through the messages in the order of their log times, those of equal times as they stand in the file;
/// by the times that the chunks claim (check() finds those that claim others than they have). Holds the
/// chunks that overlap in time, no more. A chunk that cannot be read is left out and told in problems().
class MessageCursor {
 public:
  /// The reader outlives this.
  explicit MessageCursor(const McapReader& reader, MessageFilter filter = {});
  ~MessageCursor();
  MessageCursor(MessageCursor&&) noexcept;

  /// The next message; false at the end. Its data are valid until the next call.
  bool next(Message& message);
  const std::vector<std::string>& problems() const { return problems_; }

 private:
  struct Loaded;
  void load(std::size_t block);

  const McapReader& reader_;
  MessageFilter filter_;
  std::map<std::uint16_t, bool> wanted_;
  std::size_t next_block_ = 0;
  std::vector<std::unique_ptr<Loaded>> loaded_;
  std::vector<std::string> problems_;
};

}  // namespace phantom::recording
