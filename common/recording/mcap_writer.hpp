#pragma once

#include <map>
#include <optional>

#include "common/core/status.hpp"
#include "common/core/version.hpp"
#include "common/recording/byte_sink.hpp"
#include "common/recording/compression.hpp"
#include "common/recording/mcap_records.hpp"

namespace phantom::recording {

struct WriterOptions {
  std::string profile;
  std::string library = std::string("phantom ") + core::version();
  std::size_t chunk_bytes = 1 << 20;  ///< a chunk ends at this size, uncompressed
  int zstd_level = 1;                 ///< 0: chunks are not compressed
};

/// Writes one MCAP file: messages in chunks, each with its index and checksum; schemas, channels, metadata
/// and attachments between the chunks, so that a lost chunk loses nothing but its own messages; a summary at
/// the end.
///
/// After any call, the content of the sink is a valid beginning of a file, and every chunk in it can be read.
/// After the first failure of the sink every call returns that failure. Not thread-safe.
class McapWriter {
 public:
  /// Begins the file. The sink must outlive this object.
  McapWriter(ByteSink& sink, const WriterOptions& options);

  /// Both return the id of the record in this file; they ignore the id in `record`.
  core::Expected<std::uint16_t> add_schema(Schema record);
  core::Expected<std::uint16_t> add_channel(Channel record);
  /// Writes the message into the current chunk. The channel must have been added.
  core::Status write(const Message& message);
  core::Status write(const Metadata& metadata);
  core::Status write(const Attachment& attachment);
  /// Ends the current chunk if it holds a message, so that all that was written so far can be read even if
  /// the process ends.
  core::Status end_chunk();
  /// Ends the file with summary and footer. Nothing can be written after it.
  core::Status finish();

  const core::Status& status() const { return status_; }
  /// Return the bytes in the sink, and those that wait in the current chunk (uncompressed).
  std::uint64_t bytes_written() const { return offset_; }
  std::size_t bytes_waiting() const { return chunk_.size(); }
  const Statistics& statistics() const { return statistics_; }

 private:
  template <class Record>
  core::Status put_record(const Record& record);
  core::Status put_bytes(ByteView bytes);
  void put_summary(Bytes& out);

  ByteSink& sink_;
  WriterOptions options_;
  std::optional<ZstdCompressor> compressor_;
  core::Status status_;
  bool finished_ = false;
  std::uint64_t offset_ = 0;
  std::uint32_t data_crc_ = 0;

  std::vector<Schema> schemas_;
  std::vector<Channel> channels_;
  Bytes chunk_, compressed_, buffer_;
  std::map<std::uint16_t, MessageIndex> chunk_messages_;
  std::uint64_t chunk_start_ns_ = 0, chunk_end_ns_ = 0;
  std::vector<ChunkIndex> chunk_indexes_;
  std::vector<AttachmentIndex> attachment_indexes_;
  std::vector<MetadataIndex> metadata_indexes_;
  Statistics statistics_;
};

}  // namespace phantom::recording
