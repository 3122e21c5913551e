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
  /// A cursor holds so much of the chunks that overlap in time; further ones are left out.
  std::uint64_t overlap_bytes = std::numeric_limits<std::uint64_t>::max();
};

/// The location of messages in the file: a chunk, or a run of messages outside of chunks.
struct MessageBlock {
  std::uint64_t offset = 0, length = 0;
  std::uint64_t start_ns = 0, end_ns = 0;
  bool is_chunk = true;
};

/// Reads an MCAP file, of this project or of another tool. Opens it by its summary. A file without a summary
/// (it is still being written, or its writer was killed) or with a damaged one is read from the beginning,
/// record by record, up to the first incomplete record. Not thread-safe.
class McapReader {
 public:
  /// Fails if the file does not begin as an MCAP file.
  static core::Expected<McapReader> open(std::unique_ptr<ByteSource> source, ReaderLimits limits = {});
  static core::Expected<McapReader> open(const std::filesystem::path& file, ReaderLimits limits = {});

  /// Returns whether the file was finished properly. If not, the existing part can be read, and problems()
  /// names what is missing.
  bool complete() const { return complete_; }
  const std::vector<std::string>& problems() const { return problems_; }
  /// Returns the number of chunks that were left out as the file was read without its summary.
  std::uint64_t chunks_left_out() const { return chunks_left_out_; }

  /// Returns where the summary begins; 0: there is no usable summary.
  std::uint64_t summary_start() const { return summary_start_; }
  const Header& header() const { return header_; }
  const std::map<std::uint16_t, Schema>& schemas() const { return schemas_; }
  const std::map<std::uint16_t, Channel>& channels() const { return channels_; }
  /// Returns the summary's statistics; without a summary, counts from reading the file.
  const Statistics& statistics() const { return statistics_; }
  /// Returns the blocks in the order of their first message.
  const std::vector<MessageBlock>& blocks() const { return blocks_; }
  const std::vector<MetadataIndex>& metadata_indexes() const { return metadata_indexes_; }
  const std::vector<AttachmentIndex>& attachment_indexes() const { return attachment_indexes_; }

  core::Expected<Metadata> read(const MetadataIndex& index) const;
  core::Expected<Attachment> read(const AttachmentIndex& index) const;
  /// Returns all metadata of that name in the order of writing; leaves out unreadable ones.
  std::vector<StringMap> metadata(const std::string& name) const;

  /// Returns the records in a block. They point into the buffers.
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
  template <class Record>
  core::Expected<Record> read_record(std::uint64_t offset, std::uint64_t length) const;

  std::unique_ptr<ByteSource> source_;
  ReaderLimits limits_;
  bool complete_ = false;
  std::uint64_t chunks_left_out_ = 0;
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
  std::function<bool(const Channel&)> channel;                         ///< empty: all channels
  std::uint64_t from_ns = 0;                                           ///< log times from here on …
  std::uint64_t until_ns = std::numeric_limits<std::uint64_t>::max();  ///< … and before this
};

/// Iterates over the messages in the order of their log times; messages of equal times come in the order of
/// the file. Relies on the time ranges that the chunks state (check() finds chunks that state wrong ones).
/// Holds only the chunks that overlap in time. A chunk that cannot be read, or for which the limits leave no
/// room beside those that it overlaps, is left out and reported by problems().
class MessageCursor {
 public:
  /// The reader must outlive this object.
  explicit MessageCursor(const McapReader& reader, MessageFilter filter = {});
  ~MessageCursor();
  MessageCursor(MessageCursor&&) noexcept;

  /// Reads the next message; returns false at the end. Its data are valid until the next call.
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
