#pragma once

// Private to this library: the integer geometry that voxelisation decides on.

#include <array>
#include <cstdint>
#include <vector>

#include "common/voxel/voxel_box.hpp"

namespace phantom::voxel::detail {

inline constexpr int kSubBits = 14;                  // 1/16384 voxel: 0.3 µm at 5 mm
inline constexpr std::int64_t kSub = 1 << kSubBits;  // one voxel
inline constexpr std::int64_t kReach =
    1LL << (14 + kSubBits);  // farthest coordinate: products of differences fit 63 bits

using SnappedPoint = std::array<std::int64_t, 3>;  // in 1/kSub voxel from the box's corner
using SnappedTriangle = std::array<SnappedPoint, 3>;

/// XORs into `toggles`, for every line along `axis` (0, 1, 2) through voxel centres and every triangle that
/// it crosses, the first voxel whose centre is not before the crossing; crossings before the box toggle its
/// first voxel, those behind it nothing. `parity` gets, per line, whether the number of crossings is odd: one
/// bit per (u, v), u = axis+1, v = axis+2.
void toggle_crossings(const std::vector<SnappedTriangle>& triangles, int axis, BitVolume& toggles,
                      BitVolume& parity);

/// Sets the bits of all voxels that the triangle passes through.
void mark_triangle(const SnappedTriangle& triangle, BitVolume& boundary);

}  // namespace phantom::voxel::detail
