#pragma once

#include <memory>

#include "common/core/status.hpp"
#include "common/recording/mcap_records.hpp"

namespace phantom::recording {

/// Compresses chunks; keeps its memory from one to the next. Not thread-safe.
class ZstdCompressor {
 public:
  explicit ZstdCompressor(int level);
  ~ZstdCompressor();
  ZstdCompressor(ZstdCompressor&&) noexcept;
  /// Replaces `out` by one frame that holds `bytes` and says their number.
  core::Status compress(ByteView bytes, Bytes& out);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The records of a chunk: CRC checked, decompressed if need be, not more than `limit_bytes`. The
/// compressions are "" and "zstd". `out` holds them, unless they are not compressed: then the result points
/// into the chunk.
core::Expected<ByteView> decompressed(const Chunk& chunk, std::uint64_t limit_bytes, Bytes& out);

}  // namespace phantom::recording
