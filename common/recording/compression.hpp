#pragma once

#include <memory>

#include "common/core/status.hpp"
#include "common/recording/mcap_records.hpp"

struct ZSTD_CCtx_s;

namespace phantom::recording {

/// Compresses chunks; reuses its memory for the next chunk. Not thread-safe.
class ZstdCompressor {
 public:
  explicit ZstdCompressor(int level);
  /// Replaces `out` by one frame that holds `bytes` and states their number.
  core::Status compress(ByteView bytes, Bytes& out);

 private:
  int level_;
  std::unique_ptr<ZSTD_CCtx_s, void (*)(ZSTD_CCtx_s*)> context_;
};

/// Returns the records of a chunk, decompressed if need be, of `limit_bytes` at most; checks their CRC.
/// Supported compressions are "" and "zstd". `out` holds decompressed records; for an uncompressed chunk the
/// result points into the chunk.
core::Expected<ByteView> decompressed(const Chunk& chunk, std::uint64_t limit_bytes, Bytes& out);

}  // namespace phantom::recording
