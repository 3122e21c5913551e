#pragma once

#include <cstddef>
#include <cstdint>

namespace phantom::dds {

/// Returns whether a payload of `length` octets begins as plain CDR of XTypes' version 1 in either byte order
/// (OMG DDSI-RTPS 2.5, 10.2), the one encoding that is decoded here. Real-time safe: yes.
inline bool is_plain_cdr(const std::uint8_t* octets, std::size_t length) noexcept {
  constexpr std::size_t kHeaderBytes = 4;  // kind and options
  return length >= kHeaderBytes && octets[0] == 0 && octets[1] <= 1;
}

}  // namespace phantom::dds
