#pragma once

#include <array>
#include <cstdint>

namespace phantom::dds {

/// The common prefix of all GUIDs of one participant. It identifies a process's membership in the domain; a
/// restarted process has another one.
using GuidPrefix = std::array<std::uint8_t, 12>;

}  // namespace phantom::dds
