#pragma once

#include <numbers>

namespace phantom::core {

/// Radians per degree. Texts for people use degrees; everything else uses radians.
inline constexpr double kRadPerDegree = std::numbers::pi / 180.0;

}  // namespace phantom::core
