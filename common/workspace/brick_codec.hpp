#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/core/status.hpp"
#include "common/workspace/brick_content.hpp"

namespace phantom::workspace {

/// Returns the bytes that the topic workspace_brick carries for a brick: a zstd frame with checksum and
/// content size. The frame holds the tiled form (brick_tiles.hpp) or, for a brick that does not fit that
/// form, the plain form: μ codes, orders and object ids (little endian), each kBrickVoxels long. The
/// content's size tells the two forms apart. Older servers and recordings use the plain form only. Not
/// real-time safe.
std::vector<std::uint8_t> encode_brick(const Workspace::BrickView& brick);

/// Decodes the bytes of encode_brick(). Refuses anything that is not exactly one brick, using bounded memory;
/// `content` is then undefined. Not real-time safe.
core::Status decode_brick(std::span<const std::uint8_t> bytes, BrickContent& content);

}  // namespace phantom::workspace
