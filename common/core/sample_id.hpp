#pragma once

#include <cstdint>

#include "common/core/clock.hpp"

namespace phantom::core {

/// Names one sample of a periodic topic: kept by who received it, and echoed to who made it.
struct SampleId {
  std::uint64_t sequence_number = 0;  ///< 0: none
  std::int64_t monotonic_ns = 0;      ///< when it was made, by its writer's clock
  std::uint64_t session = 0;          ///< of its writer's process

  friend bool operator==(const SampleId&, const SampleId&) = default;
};

/// When the sample was made that `echo` names, by the own monotonic clock; 0 if it is not of `own_session`,
/// or names a time that it cannot be: none, or one after `received_ns`. Real-time safe: yes.
inline Nanoseconds answered_ns(const SampleId& echo, std::uint64_t own_session,
                               Nanoseconds received_ns) noexcept {
  const bool ours = echo.session == own_session && echo.sequence_number != 0 && echo.monotonic_ns > 0 &&
                    echo.monotonic_ns <= received_ns;
  return ours ? echo.monotonic_ns : 0;
}

}  // namespace phantom::core
