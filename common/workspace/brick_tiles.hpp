#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/core/status.hpp"
#include "common/workspace/brick_content.hpp"

namespace phantom::workspace {

/// The tiled form encodes a brick tile by tile (4×4×4 voxels, brick_offset order). A kind is a combination of
/// μ code, order and object id. Most tiles hold one kind of voxel only, and most others hold two. The form
/// takes about a thirtieth of the plain arrays' bytes, so that little is left to compress and decompress. Its
/// bytes, with numbers in little endian:
///
///     1                            form: kTiledForm
///     1                            number of kinds − 1
///     1, 1, 2 × kinds              their μ codes; their orders (int8); their object ids
///     512                          for each tile, the number of its kinds: 1…64
///     1 × kinds of all tiles       the numbers of those kinds, tile by tile
///     8 × all those but the first  which of the tile's 64 voxels are of that kind (bit i: voxel i); the rest
///                                  are of the tile's first kind
///
/// Every kind occurs in the brick, and every kind that a tile names occurs in that tile.
inline constexpr std::uint8_t kTiledForm = 1;
inline constexpr std::size_t kMaxTiledBytes = 65536;

/// Writes a brick in the tiled form. Returns the number of bytes, or 0 if the brick has more than 256 kinds
/// or does not fit in `to`. Not real-time safe.
std::size_t tile_brick(const Workspace::BrickView& brick, std::span<std::uint8_t, kMaxTiledBytes> to);

/// Decodes the bytes of tile_brick(). Refuses any other form, and bytes that break the rules above; `content`
/// is then undefined. Not real-time safe.
core::Status untile_brick(std::span<const std::uint8_t> bytes, BrickContent& content);

}  // namespace phantom::workspace
