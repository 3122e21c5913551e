#include "common/workspace/brick_codec.hpp"

#include <zstd.h>

#include <array>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>

#include "common/workspace/brick_tiles.hpp"

namespace phantom::workspace {
namespace {

constexpr std::size_t kPlainBytes = kBrickVoxels * 4;
constexpr int kLevel = 1;  // bricks are smooth: higher levels cost time and save little

static_assert(sizeof(BrickData) == kPlainBytes, "a brick's memory is its plain form");

// A context is large, and newly allocated memory is slow, so each thread keeps one context for all of its
// bricks.
ZSTD_CCtx* compressor() {
  thread_local const std::unique_ptr<ZSTD_CCtx, decltype(&ZSTD_freeCCtx)> context(ZSTD_createCCtx(),
                                                                                  ZSTD_freeCCtx);
  if (context == nullptr) throw std::bad_alloc();
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kLevel);
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_checksumFlag, 1);
  return context.get();
}
ZSTD_DCtx* decompressor() {
  thread_local const std::unique_ptr<ZSTD_DCtx, decltype(&ZSTD_freeDCtx)> context(ZSTD_createDCtx(),
                                                                                  ZSTD_freeDCtx);
  if (context == nullptr) throw std::bad_alloc();
  return context.get();
}

std::vector<std::uint8_t> compress(const void* from, std::size_t from_size) {
  thread_local std::vector<std::uint8_t> bytes(ZSTD_compressBound(kPlainBytes));
  const std::size_t size = ZSTD_compress2(compressor(), bytes.data(), bytes.size(), from, from_size);
  if (ZSTD_isError(size) != 0) throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(size));
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)};
}

core::Status decompress(std::span<const std::uint8_t> bytes, void* to, std::size_t to_size) {
  const std::size_t size = ZSTD_decompressDCtx(decompressor(), to, to_size, bytes.data(), bytes.size());
  if (ZSTD_isError(size) != 0) {
    return core::Status::invalid_argument(std::string("brick: does not decompress: ") +
                                          ZSTD_getErrorName(size));
  }
  if (size != to_size) return core::Status::invalid_argument("brick: is cut short");
  return core::Status::ok();
}

using TiledBytes = std::array<std::uint8_t, kMostTiledBytes>;
static_assert(kMostTiledBytes < kPlainBytes, "sizes tell the forms apart");

}  // namespace

std::vector<std::uint8_t> encode_brick(const Workspace::BrickView& brick) {
  TiledBytes tiled;
  if (const std::size_t size = tile_brick(brick, tiled); size > 0) return compress(tiled.data(), size);
  BrickData plain;
  std::memcpy(plain.mu_code.data(), brick.mu_code, kBrickVoxels);
  std::memcpy(plain.order.data(), brick.order, kBrickVoxels);
  brick.copy_objects(plain.object.data());
  return compress(&plain, kPlainBytes);
}

core::Status decode_brick(std::span<const std::uint8_t> bytes, BrickContent& content) {
  const unsigned long long size = ZSTD_getFrameContentSize(bytes.data(), bytes.size());
  if (size == kPlainBytes) {
    if (core::Status status = decompress(bytes, &content.voxels, kPlainBytes); !status) return status;
    content.facts = facts_of(content.voxels);
    return core::Status::ok();
  }
  if (size > kMostTiledBytes) {  // also if the size is unknown, or if this is not a frame
    return core::Status::invalid_argument("brick: is not a zstd frame of a brick: its content is neither " +
                                          std::to_string(kPlainBytes) + " bytes nor at most " +
                                          std::to_string(kMostTiledBytes));
  }
  TiledBytes tiled;
  if (core::Status status = decompress(bytes, tiled.data(), size); !status) return status;
  return untile_brick({tiled.data(), size}, content);
}

}  // namespace phantom::workspace
