#pragma once

#include <cstdint>

#include "common/recording/mcap_records.hpp"

namespace phantom::recording {

/// Returns the CRC-32 (IEEE 802.3) of `bytes`, continuing from `before`, the CRC of the bytes before them.
std::uint32_t crc32(ByteView bytes, std::uint32_t before = 0);

}  // namespace phantom::recording
