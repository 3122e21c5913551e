#pragma once

#include <memory>

#include "common/core/status.hpp"
#include "common/recording/mcap_records.hpp"

namespace phantom::recording {

/// Compresses chunks; reuses its memory for the next chunk. Not thread-safe.
class ZstdCompressor {
 public:
  explicit ZstdCompressor(int level);
  ~ZstdCompressor();
  ZstdCompressor(ZstdCompressor&&) noexcept;
  /// Replaces `out` by one frame that holds `bytes` and states their number.
  core::Status compress(ByteView bytes, Bytes& out);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Returns the records of a chunk, decompressed if need be, of `limit_bytes` at most; checks their CRC.
/// Supported compressions are "" and "zstd". `out` holds decompressed records; for an uncompressed chunk the
/// result points into the chunk.
core::Expected<ByteView> decompressed(const Chunk& chunk, std::uint64_t limit_bytes, Bytes& out);

}  // namespace phantom::recording
