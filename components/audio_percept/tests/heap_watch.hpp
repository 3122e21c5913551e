#pragma once

#include <cstdint>

namespace phantom::audio_percept {

/// Heap allocations of this test process so far.
std::uint64_t heap_uses() noexcept;

}  // namespace phantom::audio_percept
