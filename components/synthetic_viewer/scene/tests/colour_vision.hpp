#pragma once
// How far colours lie apart for whom: with full colour vision, and without one kind of cones.

#include <array>
#include <cmath>

namespace phantom::synthetic_viewer::test {

using LinearColour = std::array<double, 3>;  // linear RGB, 0 to 1
using ColourMatrix = std::array<LinearColour, 3>;

/// Machado, Oliveira, Fernandes: A Physiologically-based Model for Simulation of Color Vision Deficiency,
/// IEEE TVCG 15(6), 2009, severity 1.0: full vision, protanopia, deuteranopia, tritanopia.
inline constexpr std::array<ColourMatrix, 4> kColourVisions{
    {{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
     {{{0.152286, 1.052583, -0.204868}, {0.114503, 0.786281, 0.099216}, {-0.003882, -0.048116, 1.051998}}},
     {{{0.367322, 0.860646, -0.227968}, {0.280085, 0.672501, 0.047413}, {-0.011820, 0.042940, 0.968881}}},
     {{{1.255528, -0.076749, -0.178779}, {-0.078411, 0.930809, 0.147602}, {0.004733, 0.691367, 0.303900}}}}};

inline LinearColour seen_with(const ColourMatrix& vision, const LinearColour& colour) {
  LinearColour seen{};
  for (std::size_t row = 0; row < 3; ++row) {
    for (std::size_t k = 0; k < 3; ++k) seen[row] += vision[row][k] * colour[k];
    seen[row] = std::fmin(1.0, std::fmax(0.0, seen[row]));
  }
  return seen;
}

/// CIE L*a*b*, white D65.
inline std::array<double, 3> lab_of(const LinearColour& c) {
  const auto f = [](double t) { return t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116; };
  const double x = f((0.4124 * c[0] + 0.3576 * c[1] + 0.1805 * c[2]) / 0.9505);
  const double y = f(0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]);
  const double z = f((0.0193 * c[0] + 0.1192 * c[1] + 0.9505 * c[2]) / 1.089);
  return {116 * y - 16, 500 * (x - y), 200 * (y - z)};
}

/// Returns how different two colours look (CIE 1976 ΔE) to whom that is hardest; about 2 is just noticed side
/// by side.
inline double least_difference(const LinearColour& a, const LinearColour& b) {
  double least = HUGE_VAL;
  for (const ColourMatrix& vision : kColourVisions) {
    const auto p = lab_of(seen_with(vision, a)), q = lab_of(seen_with(vision, b));
    least = std::fmin(least, std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]));
  }
  return least;
}

}  // namespace phantom::synthetic_viewer::test
