#pragma once

#include <limits>

#include "common/core/clock.hpp"

namespace phantom::core {

/// Returns the time from `from_ns` to `to_ns`. The two may have any value, because they may come from another
/// process or a file: a difference that does not fit is clamped to the nearest value that does. Real-time
/// safe: yes.
constexpr Nanoseconds elapsed_ns(Nanoseconds from_ns, Nanoseconds to_ns) noexcept {
  Nanoseconds elapsed = 0;
  if (!__builtin_sub_overflow(to_ns, from_ns, &elapsed)) return elapsed;
  return to_ns < from_ns ? std::numeric_limits<Nanoseconds>::min() : std::numeric_limits<Nanoseconds>::max();
}

}  // namespace phantom::core
