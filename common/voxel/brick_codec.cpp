#include "common/voxel/brick_codec.hpp"

#include <zstd.h>

#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>

namespace phantom::voxel {
namespace {

constexpr std::size_t kPlainBytes = kBrickVoxels * 4;
constexpr int kLevel = 1;  // bricks are smooth: higher levels cost time and save little

static_assert(sizeof(BrickData) == kPlainBytes, "a brick's memory is its plain form");

// A context is large and made of fresh memory: one for each thread, for all of its bricks.
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

}  // namespace

std::vector<std::uint8_t> encode_brick(const Workspace::BrickView& brick) {
  BrickData plain;
  std::memcpy(plain.mu_code.data(), brick.mu_code, kBrickVoxels);
  brick.copy_orders(plain.order.data());
  brick.copy_objects(plain.object.data());

  thread_local std::vector<std::uint8_t> bytes(ZSTD_compressBound(kPlainBytes));
  const std::size_t size = ZSTD_compress2(compressor(), bytes.data(), bytes.size(), &plain, kPlainBytes);
  if (ZSTD_isError(size) != 0) throw std::runtime_error(std::string("zstd: ") + ZSTD_getErrorName(size));
  return {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)};
}

core::Status decode_brick(std::span<const std::uint8_t> bytes, BrickData& brick) {
  if (ZSTD_getFrameContentSize(bytes.data(), bytes.size()) != kPlainBytes) {
    return core::Status::invalid_argument("brick: is not a zstd frame of " + std::to_string(kPlainBytes) +
                                          " bytes");
  }
  const std::size_t size =
      ZSTD_decompressDCtx(decompressor(), &brick, kPlainBytes, bytes.data(), bytes.size());
  if (ZSTD_isError(size) != 0) {
    return core::Status::invalid_argument(std::string("brick: does not decompress: ") +
                                          ZSTD_getErrorName(size));
  }
  if (size != kPlainBytes) return core::Status::invalid_argument("brick: is cut short");
  return core::Status::ok();
}

}  // namespace phantom::voxel
