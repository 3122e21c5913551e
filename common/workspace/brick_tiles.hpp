#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "common/core/status.hpp"
#include "common/workspace/brick_content.hpp"

namespace phantom::workspace {

/// A brick told tile by tile (4×4×4 voxels, brick_offset order): most tiles are all alike, most others have
/// two kinds of voxel. A kind is a μ code, an order and an object id. In a thirtieth of the plain arrays'
/// bytes, so that what is left to compress and to decompress is little. The bytes, numbers little endian:
///
///     1                            form: kTiledForm
///     1                            number of kinds − 1
///     1, 1, 2 × kinds              their μ codes; their orders (int8); their object ids
///     512                          of each tile, how many kinds it has: 1…64
///     1 × kinds of all tiles       which, tile by tile
///     8 × all those but the first  which of the tile's 64 voxels are of that kind (bit i: voxel i); the rest
///                                  are of the first kind
///
/// Every kind occurs, and so does every kind that a tile names.
inline constexpr std::uint8_t kTiledForm = 1;
inline constexpr std::size_t kMostTiledBytes = 65536;

/// Bytes written; 0: the brick has more than 256 kinds, or is not told in so few bytes. Not real-time safe.
std::size_t tile_brick(const Workspace::BrickView& brick, std::span<std::uint8_t, kMostTiledBytes> to);

/// Back from tile_brick(). Refuses whatever is not as told above; `content` is then undefined. Not
/// real-time safe.
core::Status untile_brick(std::span<const std::uint8_t> bytes, BrickContent& content);

}  // namespace phantom::workspace
