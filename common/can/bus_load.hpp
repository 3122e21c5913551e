#pragma once

#include <cstdint>

#include "common/can/frame.hpp"

namespace phantom::can {

/// Returns the greatest number of bits that a data frame of `length` bytes takes on the bus (ISO 11898-1):
/// all fields, the most stuff bits that any content can need, and the three bits of intermission. Stuff bits:
/// one after the first five equal bits, then one every four, from start of frame to the end of the checksum.
/// 135 for eight bytes with a standard identifier.
constexpr std::uint32_t worst_case_bits(std::uint32_t length, bool extended) noexcept {
  const std::uint32_t stuffable = (extended ? 54U : 34U) + 8U * length;
  constexpr std::uint32_t kDelimitersAckEndIntermission = 1 + 2 + 7 + 3;
  return stuffable + (stuffable - 1U) / 4U + kDelimitersAckEndIntermission;
}

inline std::uint32_t worst_case_bits(const CanFrame& frame) noexcept {
  return worst_case_bits(frame.remote ? 0U : frame.length, frame.extended);
}

/// Returns the arbitration field as a number. Of two frames that begin at the same time, the one with the
/// lower number wins the bus.
constexpr std::uint64_t arbitration_rank(const CanFrame& frame) noexcept {
  const std::uint64_t base = frame.extended ? frame.id >> 18 : frame.id;
  const std::uint64_t rest = frame.extended ? frame.id & 0x3FFFFU : 0U;
  const std::uint64_t remote = frame.remote ? 1U : 0U;
  // Base identifier, then RTR or SRR (recessive in extended frames), then IDE, then the rest and its RTR.
  const std::uint64_t second = frame.extended ? 1U : remote;
  const std::uint64_t ide = frame.extended ? 1U : 0U;
  return base << 21 | second << 20 | ide << 19 | rest << 1 | (frame.extended ? remote : 0U);
}

}  // namespace phantom::can
