#pragma once

#include <cstdint>
#include <vector>

#include "common/workspace/workspace.hpp"

namespace phantom::workspace {

/// Workspace::content_hash is header_hash + Σ brick_hash (mod 2⁶⁴): whoever keeps the bricks' hashes can tell
/// a version's hash without touching the voxels again.

/// Hash of what all bricks share: origin, voxel size, size, palette.
std::uint64_t header_hash(const GridSpec& grid, const std::vector<float>& palette_Pa_s_per_m);

/// Hash of one brick's place and content. Finds accidents, not forgers.
std::uint64_t brick_hash(BrickKey key, const Workspace::BrickView& brick);

}  // namespace phantom::workspace
