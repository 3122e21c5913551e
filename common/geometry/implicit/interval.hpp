#pragma once

#include <limits>

namespace phantom::geometry {

inline constexpr double kInf = std::numeric_limits<double>::infinity();

/// Holds every value that a formula can take over a region: a closed range, rounded outwards, and whether the
/// formula is defined (not NaN) in the whole region. `lo > hi`: undefined everywhere.
struct Interval {
  double lo = 0.0;
  double hi = 0.0;
  bool defined = true;  ///< whether the formula is defined at every point of the region

  Interval() = default;
  Interval(double point) : lo(point), hi(point) {}  // NOLINT: implicit by intent, as numbers are in formulas
  Interval(double low, double high, bool everywhere = true) : lo(low), hi(high), defined(everywhere) {}

  static Interval whole(bool everywhere = true) { return {-kInf, kInf, everywhere}; }
  static Interval nowhere() { return {kInf, -kInf, false}; }
  bool empty() const { return lo > hi; }
  bool contains(double value) const { return lo <= value && value <= hi; }
};

// Each function returns bounds for the function of the same name in <cmath> (or the operator), for every
// choice of points from its arguments. Real-time safe: yes.

Interval operator-(const Interval& a);
Interval operator+(const Interval& a, const Interval& b);
Interval operator-(const Interval& a, const Interval& b);
Interval operator*(const Interval& a, const Interval& b);
Interval operator/(const Interval& a, const Interval& b);
Interval min(const Interval& a, const Interval& b);
Interval max(const Interval& a, const Interval& b);
Interval square(const Interval& a);
inline double square(double a) { return a * a; }  // lets one formula serve numbers and intervals
Interval abs(const Interval& a);
Interval sqrt(const Interval& a);
Interval exp(const Interval& a);
Interval log(const Interval& a);
Interval sin(const Interval& a);
Interval cos(const Interval& a);
Interval tan(const Interval& a);
Interval asin(const Interval& a);
Interval acos(const Interval& a);
Interval atan(const Interval& a);
Interval sinh(const Interval& a);
Interval cosh(const Interval& a);
Interval tanh(const Interval& a);
Interval pow(const Interval& a, const Interval& b);

}  // namespace phantom::geometry
