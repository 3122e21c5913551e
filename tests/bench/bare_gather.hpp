#pragma once

#include <cstddef>
#include <cstdint>

namespace phantom::bench {

/// The floor of sensing: for n places (a multiple of 16) known beforehand, the brick's slot is gathered from
/// the directory and the voxel's byte from the bricks, and the bytes are summed. `brick` indexes the
/// directory, `word` the 32-bit word in the brick, `shift` picks its byte.
std::uint64_t bare_gather(const std::uint32_t* directory, const std::uint8_t* codes,
                          const std::int32_t* brick, const std::int32_t* word, const std::uint32_t* shift,
                          std::size_t n);

/// The same with one level: `word` counts from the first brick on.
std::uint64_t bare_gather_flat(const std::uint8_t* codes, const std::int32_t* word,
                               const std::uint32_t* shift, std::size_t n);

}  // namespace phantom::bench
