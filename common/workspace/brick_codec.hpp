#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "common/core/status.hpp"
#include "common/workspace/brick_content.hpp"

namespace phantom::workspace {

/// Bytes of the topic workspace_brick: a zstd frame (with checksum and size of content) of the brick in the
/// tiled form of brick_tiles.hpp; of a brick that this cannot tell, the plain form: μ codes, orders and
/// object ids (little endian), each kBrickVoxels long. The content's size tells the forms apart; older
/// servers and recordings have the plain one alone. Not real-time safe.
std::vector<std::uint8_t> encode_brick(const Workspace::BrickView& brick);

/// Back from encode_brick(). Refuses anything that is not exactly one brick, in bounded memory; `content` is
/// then undefined. Not real-time safe.
core::Status decode_brick(std::span<const std::uint8_t> bytes, BrickContent& content);

}  // namespace phantom::workspace
