#pragma once

#include <cstdint>

#include "common/core/clock.hpp"

namespace phantom::core {

/// Identifies one sample of a periodic topic. The receiver keeps it and echoes it to the sender.
struct SampleId {
  std::uint64_t sequence_number = 0;  ///< 0: none
  std::int64_t monotonic_ns = 0;      ///< when it was made, on its writer's clock
  std::uint64_t session = 0;          ///< of its writer's process

  friend bool operator==(const SampleId&, const SampleId&) = default;
};

/// Returns when the sample that `echo` names was made, on this host's monotonic clock. Returns 0 if the
/// sample is not of `own_session`, has no number or no time, or has a time after `received_ns`. Real-time
/// safe: yes.
inline Nanoseconds answered_ns(const SampleId& echo, std::uint64_t own_session,
                               Nanoseconds received_ns) noexcept {
  const bool ours = echo.session == own_session && echo.sequence_number != 0 && echo.monotonic_ns > 0 &&
                    echo.monotonic_ns <= received_ns;
  return ours ? echo.monotonic_ns : 0;
}

}  // namespace phantom::core
