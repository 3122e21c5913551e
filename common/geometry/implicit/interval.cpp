#include "common/geometry/implicit/interval.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace phantom::geometry {
namespace {

// Two units in the last place cover the rounding of the operators and of the C library's functions. A sum of
// squares that is exactly 0 stays 0, so that its root is defined.
double down(double v) { return std::isfinite(v) && v != 0.0 ? v - (std::abs(v) * 5e-16 + 1e-307) : v; }
double up(double v) { return std::isfinite(v) && v != 0.0 ? v + (std::abs(v) * 5e-16 + 1e-307) : v; }

/// Returns a range from computed end points, widened to cover their rounding. An end point that is NaN (∞ −
/// ∞, 0 · ∞) gives the whole range.
Interval outward(double lo, double hi, bool defined) {
  if (std::isnan(lo) || std::isnan(hi)) return Interval::whole(false);
  return {down(lo), up(hi), defined};
}

bool endless(const Interval& a) { return std::isinf(a.lo) || std::isinf(a.hi); }

/// Bounds what takes its extremes at four computed points.
Interval around(const double (&ends)[4], bool defined) {
  if (std::any_of(ends, ends + 4, [](double end) { return std::isnan(end); })) return Interval::whole(false);
  return outward(*std::min_element(ends, ends + 4), *std::max_element(ends, ends + 4), defined);
}

/// Bounds a function that rises on [from, to] and is undefined elsewhere.
Interval rising(const Interval& a, double from, double to, double (*f)(double)) {
  if (a.empty() || a.hi < from || a.lo > to) return Interval::nowhere();
  const bool defined = a.defined && a.lo >= from && a.hi <= to;
  return outward(f(std::max(a.lo, from)), f(std::min(a.hi, to)), defined);
}

/// Returns whether `phase` + k·`period` lies in [lo, hi] for a whole k; returns true in doubt.
bool holds_multiple(double lo, double hi, double phase, double period) {
  const double margin = 1e-12 * (1.0 + std::max(std::abs(lo), std::abs(hi)));
  return std::floor((hi - phase + margin) / period) >= std::ceil((lo - phase - margin) / period);
}

/// Bounds a function that swings between −1 and 1 and is greatest `phase` turns from 0.
Interval wave(const Interval& a, double phase, double (*f)(double)) {
  if (a.empty()) return a;
  if (!(std::abs(a.lo) < 1e9 && std::abs(a.hi) < 1e9))
    return {-1.0, 1.0, a.defined && std::isfinite(a.lo) && std::isfinite(a.hi)};
  constexpr double kTurn = 2.0 * std::numbers::pi;
  Interval found = outward(std::min(f(a.lo), f(a.hi)), std::max(f(a.lo), f(a.hi)), a.defined);
  if (holds_multiple(a.lo, a.hi, phase * kTurn, kTurn)) found.hi = 1.0;
  if (holds_multiple(a.lo, a.hi, (phase + 0.5) * kTurn, kTurn)) found.lo = -1.0;
  return found;
}

/// Bounds x^n for whole n.
Interval whole_power(const Interval& a, double n) {
  if (n == 0.0) return {1.0, 1.0, a.defined};
  const bool even = std::fmod(n, 2.0) == 0.0;
  const double at_lo = std::pow(a.lo, n), at_hi = std::pow(a.hi, n);
  const bool holds_zero = a.contains(0.0);
  if (n < 0 && holds_zero) {
    return even ? Interval{down(std::min(at_lo, at_hi)), kInf, a.defined} : Interval::whole(a.defined);
  }
  if (even && holds_zero) return outward(0.0, std::max(at_lo, at_hi), a.defined);
  return outward(std::min(at_lo, at_hi), std::max(at_lo, at_hi), a.defined);
}

}  // namespace

Interval operator-(const Interval& a) { return a.empty() ? a : Interval{-a.hi, -a.lo, a.defined}; }

Interval operator+(const Interval& a, const Interval& b) {
  if (a.empty() || b.empty()) return Interval::nowhere();
  return outward(a.lo + b.lo, a.hi + b.hi, a.defined && b.defined && !(endless(a) && endless(b)));  // ∞ − ∞
}

Interval operator-(const Interval& a, const Interval& b) { return a + -b; }

Interval operator*(const Interval& a, const Interval& b) {
  if (a.empty() || b.empty()) return Interval::nowhere();
  return around({a.lo * b.lo, a.lo * b.hi, a.hi * b.lo, a.hi * b.hi},
                a.defined && b.defined && !endless(a) && !endless(b));  // 0 · ∞
}

Interval operator/(const Interval& a, const Interval& b) {
  if (a.empty() || b.empty()) return Interval::nowhere();
  if (b.contains(0.0)) return Interval::whole(false);  // may include 0 / 0
  return around({a.lo / b.lo, a.lo / b.hi, a.hi / b.lo, a.hi / b.hi},
                a.defined && b.defined && !(endless(a) && endless(b)));  // ∞ / ∞
}

Interval min(const Interval& a, const Interval& b) {
  if (a.empty() || b.empty()) return Interval::nowhere();
  return {std::min(a.lo, b.lo), std::min(a.hi, b.hi), a.defined && b.defined};
}

Interval max(const Interval& a, const Interval& b) {
  if (a.empty() || b.empty()) return Interval::nowhere();
  return {std::max(a.lo, b.lo), std::max(a.hi, b.hi), a.defined && b.defined};
}

Interval square(const Interval& a) { return a.empty() ? a : whole_power(a, 2.0); }

Interval abs(const Interval& a) {
  if (a.empty()) return a;
  const double least = a.contains(0.0) ? 0.0 : std::min(std::abs(a.lo), std::abs(a.hi));
  return {least, std::max(std::abs(a.lo), std::abs(a.hi)), a.defined};
}

Interval sqrt(const Interval& a) { return rising(a, 0.0, kInf, std::sqrt); }
Interval exp(const Interval& a) { return rising(a, -kInf, kInf, std::exp); }
Interval log(const Interval& a) { return rising(a, 0.0, kInf, std::log); }
Interval asin(const Interval& a) { return rising(a, -1.0, 1.0, std::asin); }
Interval acos(const Interval& a) {
  return -rising(a, -1.0, 1.0, [](double v) { return -std::acos(v); });
}
Interval atan(const Interval& a) { return rising(a, -kInf, kInf, std::atan); }
Interval sinh(const Interval& a) { return rising(a, -kInf, kInf, std::sinh); }
Interval tanh(const Interval& a) { return rising(a, -kInf, kInf, std::tanh); }

Interval cosh(const Interval& a) {
  if (a.empty()) return a;
  const Interval size = abs(a);
  return outward(std::cosh(size.lo), std::cosh(size.hi), a.defined);
}

Interval sin(const Interval& a) { return wave(a, 0.25, std::sin); }
Interval cos(const Interval& a) { return wave(a, 0.0, std::cos); }

Interval tan(const Interval& a) {
  if (a.empty()) return a;
  if (!(std::abs(a.lo) < 1e9 && std::abs(a.hi) < 1e9)) return Interval::whole(false);
  if (holds_multiple(a.lo, a.hi, 0.5 * std::numbers::pi, std::numbers::pi)) return Interval::whole(a.defined);
  return outward(std::tan(a.lo), std::tan(a.hi), a.defined);
}

Interval pow(const Interval& a, const Interval& b) {
  if (a.empty() || b.empty()) return Interval::nowhere();
  const bool defined = a.defined && b.defined;
  if (b.lo == b.hi && std::abs(b.lo) < 1e9 && b.lo == std::floor(b.lo)) {
    Interval found = whole_power(a, b.lo);
    found.defined = found.defined && defined;
    return found;
  }
  if (a.hi < 0.0 && b.lo == b.hi) return Interval::nowhere();  // a negative number to a fractional power
  if (a.lo < 0.0 && b.lo != b.hi) return Interval::whole(false);
  // For a base ≥ 0 the power is monotonic in each argument, so that its extremes are at the corners.
  const double base = std::max(a.lo, 0.0);
  return around({std::pow(base, b.lo), std::pow(base, b.hi), std::pow(a.hi, b.lo), std::pow(a.hi, b.hi)},
                defined && a.lo >= 0.0);
}

}  // namespace phantom::geometry
