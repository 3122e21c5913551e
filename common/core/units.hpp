#pragma once

#include <numbers>

namespace phantom::core {

/// Radians in a degree: texts for people speak of degrees, everything inside of radians.
inline constexpr double kRadPerDegree = std::numbers::pi / 180.0;

}  // namespace phantom::core
