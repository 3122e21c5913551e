#pragma once

#include <cstdint>

namespace phantom::core {

/// Names one sample of a periodic topic: kept by who received it, and echoed to who made it.
struct SampleId {
  std::uint64_t sequence_number = 0;  ///< 0: none
  std::int64_t monotonic_ns = 0;      ///< when it was made, by its writer's clock
  std::uint64_t session = 0;          ///< of its writer's process
};

}  // namespace phantom::core
