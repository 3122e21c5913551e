#include "common/recording/checksum.hpp"

#include <zlib.h>

namespace phantom::recording {

std::uint32_t crc32(ByteView bytes, std::uint32_t before) {
  return static_cast<std::uint32_t>(crc32_z(before, bytes.data(), bytes.size()));
}

}  // namespace phantom::recording
