#pragma once

// The records of the MCAP file format, version 0 (https://mcap.dev/spec): plain values, written to and read
// from bytes. This file knows no file system, clock or topic.

#include <array>
#include <cstdint>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace phantom::recording {

using Bytes = std::vector<std::uint8_t>;
using ByteView = std::span<const std::uint8_t>;
using StringMap = std::map<std::string, std::string>;

/// First and last bytes of every file.
inline constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'M', 'C', 'A', 'P', 0x30, '\r', '\n'};
/// Size of the opcode and the length before the content of every record.
inline constexpr std::size_t kRecordHeadBytes = 9;

enum class Opcode : std::uint8_t {
  kHeader = 0x01,
  kFooter = 0x02,
  kSchema = 0x03,
  kChannel = 0x04,
  kMessage = 0x05,
  kChunk = 0x06,
  kMessageIndex = 0x07,
  kChunkIndex = 0x08,
  kAttachment = 0x09,
  kAttachmentIndex = 0x0A,
  kStatistics = 0x0B,
  kMetadata = 0x0C,
  kMetadataIndex = 0x0D,
  kSummaryOffset = 0x0E,
  kDataEnd = 0x0F,
};

struct Header {
  static constexpr Opcode kOpcode = Opcode::kHeader;
  std::string profile;  ///< empty: no registered profile
  std::string library;  ///< program that wrote the file
  bool operator==(const Header&) const = default;
};

struct Footer {
  static constexpr Opcode kOpcode = Opcode::kFooter;
  std::uint64_t summary_start = 0;         ///< 0: the file has no summary
  std::uint64_t summary_offset_start = 0;  ///< 0: no summary offsets
  std::uint32_t summary_crc = 0;           ///< from summary_start through summary_offset_start; 0: none
  bool operator==(const Footer&) const = default;
};

struct Schema {
  static constexpr Opcode kOpcode = Opcode::kSchema;
  std::uint16_t id = 0;  ///< ≥ 1
  std::string name;
  std::string encoding;  ///< "omgidl", … (https://mcap.dev/spec/registry); empty: none
  Bytes data;
  bool operator==(const Schema&) const = default;
};

struct Channel {
  static constexpr Opcode kOpcode = Opcode::kChannel;
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;  ///< 0: no schema
  std::string topic;
  std::string message_encoding;  ///< "cdr", …
  StringMap metadata;
  bool operator==(const Channel&) const = default;
};

/// `data` points into the bytes that the message was read from or is written from.
struct Message {
  static constexpr Opcode kOpcode = Opcode::kMessage;
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time_ns = 0;      ///< when it was recorded, ns since 1970-01-01 UTC
  std::uint64_t publish_time_ns = 0;  ///< when it was published
  ByteView data;
};

struct Chunk {
  static constexpr Opcode kOpcode = Opcode::kChunk;
  std::uint64_t message_start_time_ns = 0, message_end_time_ns = 0;
  std::uint64_t uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;  ///< 0: none
  std::string compression;             ///< "", "zstd" (or another tool's "lz4")
  ByteView records;                    ///< compressed
};

struct MessageIndex {
  static constexpr Opcode kOpcode = Opcode::kMessageIndex;
  std::uint16_t channel_id = 0;
  /// Log time, and offset in the chunk's uncompressed records.
  std::vector<std::pair<std::uint64_t, std::uint64_t>> records;
  bool operator==(const MessageIndex&) const = default;
};

struct ChunkIndex {
  static constexpr Opcode kOpcode = Opcode::kChunkIndex;
  std::uint64_t message_start_time_ns = 0, message_end_time_ns = 0;
  std::uint64_t chunk_start_offset = 0, chunk_length = 0;  ///< of the complete record, head included
  std::map<std::uint16_t, std::uint64_t> message_index_offsets;
  std::uint64_t message_index_length = 0;
  std::string compression;
  std::uint64_t compressed_size = 0, uncompressed_size = 0;
  bool operator==(const ChunkIndex&) const = default;
};

struct Attachment {
  static constexpr Opcode kOpcode = Opcode::kAttachment;
  std::uint64_t log_time_ns = 0, create_time_ns = 0;
  std::string name, media_type;
  Bytes data;  ///< the CRC is added on writing and checked on reading
  bool operator==(const Attachment&) const = default;
};

struct AttachmentIndex {
  static constexpr Opcode kOpcode = Opcode::kAttachmentIndex;
  std::uint64_t offset = 0, length = 0;
  std::uint64_t log_time_ns = 0, create_time_ns = 0, data_size = 0;
  std::string name, media_type;
  bool operator==(const AttachmentIndex&) const = default;
};

struct Statistics {
  static constexpr Opcode kOpcode = Opcode::kStatistics;
  std::uint64_t message_count = 0;
  std::uint16_t schema_count = 0;
  std::uint32_t channel_count = 0, attachment_count = 0, metadata_count = 0, chunk_count = 0;
  std::uint64_t message_start_time_ns = 0, message_end_time_ns = 0;
  std::map<std::uint16_t, std::uint64_t> channel_message_counts;
  void count(std::uint16_t channel_id, std::uint64_t log_time_ns);
  bool operator==(const Statistics&) const = default;
};

struct Metadata {
  static constexpr Opcode kOpcode = Opcode::kMetadata;
  std::string name;
  StringMap metadata;
  bool operator==(const Metadata&) const = default;
};

struct MetadataIndex {
  static constexpr Opcode kOpcode = Opcode::kMetadataIndex;
  std::uint64_t offset = 0, length = 0;
  std::string name;
  bool operator==(const MetadataIndex&) const = default;
};

struct SummaryOffset {
  static constexpr Opcode kOpcode = Opcode::kSummaryOffset;
  Opcode group_opcode = Opcode::kSchema;
  std::uint64_t group_start = 0, group_length = 0;
  bool operator==(const SummaryOffset&) const = default;
};

struct DataEnd {
  static constexpr Opcode kOpcode = Opcode::kDataEnd;
  std::uint32_t data_section_crc = 0;  ///< from the file's first byte to this record; 0: none
  bool operator==(const DataEnd&) const = default;
};

/// Appends the complete record, head included. Views in the record must not point into `out`. Record: any of
/// the above.
template <class Record>
void append(Bytes& out, const Record& record);

/// Parses a record's content (without its head). Returns false if it is invalid: too short, a length beyond
/// its end, a wrong checksum of its own. Fields after the known ones are ignored, as the format requires.
/// Views in the result point into `content`.
template <class Record>
bool parse(ByteView content, Record& record);

/// One record in a run of bytes.
struct RecordView {
  Opcode opcode{};
  ByteView content;
  std::size_t size() const { return kRecordHeadBytes + content.size(); }
};

/// Reads the record at the beginning of `bytes`. Returns false if the record is incomplete.
bool next_record(ByteView bytes, RecordView& record);

/// Returns the length of the content that a record's head states. `head`: kRecordHeadBytes.
std::uint64_t content_length(ByteView head);

/// Returns the CRC-32 (IEEE 802.3) of `bytes`, continuing from `before`, the CRC of the bytes before them.
std::uint32_t crc32(ByteView bytes, std::uint32_t before = 0);

}  // namespace phantom::recording
