#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace phantom::core {

/// Maximum number of joints of an arm (spec: serial arms, n ≤ 16).
inline constexpr std::size_t kMaxJoints = 16;

/// One value per joint; values past the arm's joint count are zero. The size is fixed, so that real-time
/// snapshots copy it without the heap. Units are in the variable's name: for a prismatic joint read rad as m
/// and N·m as N.
using JointArray = std::array<double, kMaxJoints>;

/// Returns whether the first `count` values are finite. Real-time safe: yes.
inline bool all_finite(const JointArray& values, std::size_t count) noexcept {
  for (std::size_t i = 0; i < count; ++i) {
    if (!std::isfinite(values[i])) return false;
  }
  return true;
}

}  // namespace phantom::core
