#pragma once

#include <unistd.h>

#include <cstdint>

namespace phantom::core {

/// Returns the size of the machine's memory in bytes.
inline std::uint64_t memory_of_the_machine() {
  return static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
         static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

}  // namespace phantom::core
