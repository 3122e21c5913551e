#include "common/workspace/compression.hpp"

#include <zstd.h>

#include <memory>
#include <new>
#include <stdexcept>
#include <string>

namespace phantom::workspace {

// A context is large, and newly allocated memory is slow, so each thread keeps its contexts.
std::vector<std::uint8_t> compress(std::span<const std::uint8_t> bytes) {
  thread_local const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(),
                                                                                  ZSTD_freeCCtx);
  thread_local std::vector<std::uint8_t> frame;
  if (context == nullptr) throw std::bad_alloc();
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, 1);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  if (frame.size() < ZSTD_compressBound(bytes.size())) frame.resize(ZSTD_compressBound(bytes.size()));
  const std::size_t size =
      ZSTD_compress2(context.get(), frame.data(), frame.size(), bytes.data(), bytes.size());
  if (ZSTD_isError(size) != 0) throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(size));
  return {frame.begin(), frame.begin() + static_cast<std::ptrdiff_t>(size)};
}

std::optional<std::uint64_t> content_size(std::span<const std::uint8_t> frame) {
  const unsigned long long size = ZSTD_getFrameContentSize(frame.data(), frame.size());
  if (size == ZSTD_CONTENTSIZE_UNKNOWN || size == ZSTD_CONTENTSIZE_ERROR) return std::nullopt;
  return size;
}

core::Status decompress(std::span<const std::uint8_t> frame, std::span<std::uint8_t> to) {
  thread_local const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(),
                                                                                  ZSTD_freeDCtx);
  if (context == nullptr) throw std::bad_alloc();
  const std::size_t size =
      ZSTD_decompressDCtx(context.get(), to.data(), to.size(), frame.data(), frame.size());
  if (ZSTD_isError(size) != 0)
    return core::Status::invalid_argument(std::string("does not decompress: ") + ZSTD_getErrorName(size));
  if (size != to.size()) return core::Status::invalid_argument("is cut short");
  return core::Status::ok();
}

}  // namespace phantom::workspace
