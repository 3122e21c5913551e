#pragma once

#include <limits>

#include "common/core/clock.hpp"

namespace phantom::core {

/// Time from `from_ns` to `to_ns`, for times that another process or a file tells and that may be anything:
/// where it does not fit, the nearest that does. Real-time safe: yes.
constexpr Nanoseconds elapsed_ns(Nanoseconds from_ns, Nanoseconds to_ns) noexcept {
  Nanoseconds elapsed = 0;
  if (!__builtin_sub_overflow(to_ns, from_ns, &elapsed)) return elapsed;
  return to_ns < from_ns ? std::numeric_limits<Nanoseconds>::min() : std::numeric_limits<Nanoseconds>::max();
}

}  // namespace phantom::core
