#include "common/workspace/brick_codec.hpp"

#include <array>
#include <cstring>
#include <string>

#include "common/workspace/brick_tiles.hpp"
#include "common/workspace/compression.hpp"

namespace phantom::workspace {
namespace {

constexpr std::size_t kPlainBytes = kBrickVoxels * 4;
static_assert(sizeof(BrickData) == kPlainBytes, "a brick's memory is its plain form");

using TiledBytes = std::array<std::uint8_t, kMaxTiledBytes>;
static_assert(kMaxTiledBytes < kPlainBytes, "sizes tell the forms apart");

core::Status decompress_brick(std::span<const std::uint8_t> bytes, void* to, std::size_t size) {
  const core::Status status = decompress(bytes, {static_cast<std::uint8_t*>(to), size});
  return status ? status : core::Status::invalid_argument("brick: " + status.message());
}

}  // namespace

std::vector<std::uint8_t> encode_brick(const Workspace::BrickView& brick) {
  TiledBytes tiled;
  if (const std::size_t size = tile_brick(brick, tiled); size > 0) return compress({tiled.data(), size});
  BrickData plain;
  std::memcpy(plain.mu_code.data(), brick.mu_code, kBrickVoxels);
  std::memcpy(plain.order.data(), brick.order, kBrickVoxels);
  brick.copy_objects(plain.object.data());
  return compress({reinterpret_cast<const std::uint8_t*>(&plain), kPlainBytes});
}

core::Status decode_brick(std::span<const std::uint8_t> bytes, BrickContent& content) {
  const std::uint64_t size = content_size(bytes).value_or(UINT64_MAX);
  if (size == kPlainBytes) {
    if (core::Status status = decompress_brick(bytes, &content.voxels, kPlainBytes); !status) return status;
    content.facts = facts_of(content.voxels);
    return core::Status::ok();
  }
  if (size > kMaxTiledBytes) {
    return core::Status::invalid_argument("brick: is not a zstd frame of a brick: its content is neither " +
                                          std::to_string(kPlainBytes) + " bytes nor at most " +
                                          std::to_string(kMaxTiledBytes));
  }
  TiledBytes tiled;
  if (core::Status status = decompress_brick(bytes, tiled.data(), size); !status) return status;
  return untile_brick({tiled.data(), size}, content);
}

}  // namespace phantom::workspace
