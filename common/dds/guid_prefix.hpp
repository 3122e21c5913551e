#pragma once

#include <array>
#include <cstdint>

namespace phantom::dds {

/// What all GUIDs of one participant begin with: it names a process's membership, and another one after its
/// restart.
using GuidPrefix = std::array<std::uint8_t, 12>;

}  // namespace phantom::dds
