#pragma once

// Private to this library: exact Euclidean distance up to a reach B, in small integers, one axis after the
// other.

#include <array>
#include <cstdint>
#include <vector>

namespace phantom::voxel::detail {

/// In: 0 where solid, B + 1 elsewhere (x fastest, then y, z). Out: distance in voxels to the nearest solid
/// voxel of the same line along z, B + 1 for "farther than B". B ≤ 254.
void distance_along_z(std::uint8_t* voxels, const std::array<std::int32_t, 3>& size, std::uint8_t reach);

/// In: distances along z. Out: orders_by_square[d²] with d the distance in space; `orders_by_square` has (B +
/// 1)² + 1 entries, of which the last stands for everything farther than B.
void orders_of_slices(std::uint8_t* voxels, const std::array<std::int32_t, 3>& size, std::uint8_t reach,
                      const std::vector<std::int8_t>& orders_by_square);

}  // namespace phantom::voxel::detail
