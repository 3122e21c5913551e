#include "common/core/clock.hpp"

#include <time.h>

namespace phantom::core {
namespace {

Nanoseconds read_clock(clockid_t clock) noexcept {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<Nanoseconds>(now.tv_sec) * kNsPerSecond + now.tv_nsec;
}

}  // namespace

Nanoseconds monotonic_ns() noexcept { return read_clock(CLOCK_MONOTONIC); }
Nanoseconds utc_ns() noexcept { return read_clock(CLOCK_REALTIME); }

}  // namespace phantom::core
