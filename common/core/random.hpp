#pragma once

#include <cstdint>
#include <random>

namespace phantom::core {

/// Returns a number from the system's source of randomness; never 0. Not real-time safe.
inline std::uint64_t random_number() {
  std::random_device device;
  const std::uint64_t high = device();
  return (high << 32 | device()) | 1U;
}

}  // namespace phantom::core
