#pragma once

#include <cstdint>

namespace phantom::core {

using Nanoseconds = std::int64_t;

inline constexpr Nanoseconds kNsPerSecond = 1'000'000'000;
inline constexpr Nanoseconds kNsPerMillisecond = 1'000'000;

/// Returns CLOCK_MONOTONIC in nanoseconds: the only clock for ages, periods and time-outs. Its values are
/// comparable on one host only. Real-time safe: yes (vDSO).
Nanoseconds monotonic_ns() noexcept;

/// Returns CLOCK_REALTIME in nanoseconds since 1970-01-01 UTC: for humans, logs and comparison between hosts,
/// never for timing. Real-time safe: yes (vDSO).
Nanoseconds utc_ns() noexcept;

constexpr double seconds(Nanoseconds duration) { return static_cast<double>(duration) * 1e-9; }
constexpr Nanoseconds from_seconds(double duration_s) { return static_cast<Nanoseconds>(duration_s * 1e9); }

}  // namespace phantom::core
