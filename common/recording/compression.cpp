#include "common/recording/compression.hpp"

#include <zstd.h>

#include <string>

namespace phantom::recording {
namespace {

core::Status unusable(const std::string& why) { return core::Status::invalid_argument("a chunk " + why); }

struct FreeContext {
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

core::Status decompress(const Chunk& chunk, Bytes& out) {
  // Kept, because it is too expensive to create for each small chunk.
  thread_local const std::unique_ptr<ZSTD_DCtx, FreeContext> context(ZSTD_createDCtx());
  // Checks the size that the frame states first: a size that is merely claimed must not allocate memory.
  const unsigned long long size = ZSTD_getFrameContentSize(chunk.records.data(), chunk.records.size());
  const bool unknown = size == ZSTD_CONTENTSIZE_UNKNOWN;
  if (size == ZSTD_CONTENTSIZE_ERROR || (!unknown && size != chunk.uncompressed_size))
    return unusable("does not hold the zstd frame that it says");
  out.resize(static_cast<std::size_t>(chunk.uncompressed_size));
  const std::size_t got =
      ZSTD_decompressDCtx(context.get(), out.data(), out.size(), chunk.records.data(), chunk.records.size());
  if (ZSTD_isError(got)) return unusable(std::string("cannot be decompressed: ") + ZSTD_getErrorName(got));
  if (got != out.size()) return unusable("decompresses to another size than it says");
  return {};
}

}  // namespace

ZstdCompressor::ZstdCompressor(int level)
    : level_(level), context_(ZSTD_createCCtx(), [](ZSTD_CCtx* context) { ZSTD_freeCCtx(context); }) {}

core::Status ZstdCompressor::compress(ByteView bytes, Bytes& out) {
  out.resize(ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compressCCtx(context_.get(), out.data(), out.size(), bytes.data(), bytes.size(), level_);
  if (ZSTD_isError(size))
    return {core::ErrorCode::kInternal,
            std::string("a chunk cannot be compressed: ") + ZSTD_getErrorName(size)};
  out.resize(size);
  return {};
}

core::Expected<ByteView> decompressed(const Chunk& chunk, std::uint64_t limit_bytes, Bytes& out) {
  if (chunk.uncompressed_size > limit_bytes)
    return unusable("says it holds " + std::to_string(chunk.uncompressed_size) +
                    " bytes; allowed: " + std::to_string(limit_bytes));
  ByteView records = chunk.records;
  if (chunk.compression == "zstd") {
    if (core::Status status = decompress(chunk, out); !status) return status;
    records = out;
  } else if (!chunk.compression.empty()) {
    return unusable("is compressed with '" + chunk.compression + "'; readable: zstd, none");
  } else if (chunk.uncompressed_size != records.size()) {
    return unusable("has another size than it says");
  }
  if (chunk.uncompressed_crc != 0 && chunk.uncompressed_crc != crc32(records))
    return unusable("is damaged: its checksum does not fit");
  return records;
}

}  // namespace phantom::recording
