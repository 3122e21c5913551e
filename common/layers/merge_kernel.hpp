#pragma once

// Private to this library: one object's merge_candidate on one brick, byte by byte.

#include "common/workspace/profile.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::layers::detail {

/// Looks up the μ codes of kBrickVoxels orders. If `objects` is not null, sets it to `id` where there is a
/// code, else to 0.
void codes_of(const workspace::CodeTable& table, const std::int8_t* orders, std::uint16_t id,
              std::uint8_t* codes, std::uint16_t* objects);

/// Takes the voxels in which an object's code is higher than the present one, except those with a code in
/// `locked` (may be null).
void merge_candidate(const workspace::CodeTable& table, const std::int8_t* orders, std::uint16_t id,
                     const std::uint8_t* locked, std::uint8_t* codes, std::int8_t* winners,
                     std::uint16_t* objects);

}  // namespace phantom::layers::detail
