#pragma once

#include <cstdint>
#include <vector>

#include "common/workspace/workspace.hpp"

namespace phantom::workspace {

/// Workspace::content_hash is header_hash + Σ brick_hash (mod 2⁶⁴). So the hash of a version follows from the
/// hashes of its bricks, without reading the voxels again.

/// Returns a hash of what all bricks share: origin, voxel size, size, palette.
std::uint64_t header_hash(const GridSpec& grid, const std::vector<float>& palette_Pa_s_per_m);

/// Returns a hash of one brick's place and content. It detects accidental changes, not forgery.
std::uint64_t brick_hash(BrickKey key, const Workspace::BrickView& brick);

}  // namespace phantom::workspace
