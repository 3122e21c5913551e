#pragma once

// Private to this library: one object's claim on one brick, byte by byte.

#include "common/voxel/profile.hpp"
#include "common/voxel/workspace.hpp"

namespace phantom::voxel::detail {

/// μ codes of kBrickVoxels orders.
void codes_of(const CodeTable& table, const std::int8_t* orders, std::uint8_t* codes);

/// Takes the voxels in which an object's code is above that which is there, unless `settled` (may be null) has one
/// there. `taken`: 255 where it did, else 0.
void claim(const CodeTable& table, const std::int8_t* orders, const std::uint8_t* settled, std::uint8_t* codes, std::int8_t* winners,
           std::uint8_t* taken);

}  // namespace phantom::voxel::detail
