#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/interval.hpp"

namespace phantom::geometry {

/// A formula parsed from text, such as "x^2 + y^2 + z^2 - 0.04". It may contain numbers, variables, + - * / ^
/// ( ), the constants pi and e, and the functions sin cos tan asin acos atan sinh cosh tanh exp log (natural)
/// log10 sqrt abs (one argument), pow (two), min max length (two or more; length is the root of the sum of
/// squares). ^ binds more strongly than a sign and is right-associative: -x^2 is -(x^2), 2^3^2 is 2^9.
///
/// Evaluation allocates nothing: real-time safe.
class Formula {
 public:
  /// Parses a formula in the given variables. On an error returns kInvalidArgument; the message names the
  /// column (from 1), the text there and what is allowed.
  static core::Expected<Formula> parse(const std::string& text, const std::vector<std::string>& variables);

  /// Returns the value for given variables, in the order given to parse(); NaN where the formula is
  /// undefined.
  double value(std::span<const double> variables) const;
  /// Returns an interval that holds value() for every choice of variables from the given intervals.
  Interval bounds(std::span<const Interval> variables) const;

  const std::string& text() const { return text_; }

  /// Greatest number of intermediate results and of steps of an evaluation.
  static constexpr std::size_t kMaxDepth = 64, kMaxSteps = 4096;

 private:
  friend class FormulaParser;
  enum class Op : std::uint8_t {
    kNumber,
    kVariable,
    kAdd,
    kSubtract,
    kMultiply,
    kDivide,
    kPower,
    kNegate,
    kSine,
    kCosine,
    kTangent,
    kArcSine,
    kArcCosine,
    kArcTangent,
    kSinh,
    kCosh,
    kTanh,
    kExp,
    kLog,
    kLog10,
    kRoot,
    kAbs,
    kMin,
    kMax,
    kLength
  };
  struct Step {  // a step of a program in postfix order
    Op op = Op::kNumber;
    std::uint32_t variable = 0;
    double number = 0.0;
  };
  static bool takes_two(Op op) { return op > Op::kVariable && (op <= Op::kPower || op >= Op::kMin); }
  template <class T>
  static T of_one(Op op, const T& a);
  template <class T>
  static T of_two(Op op, const T& a, const T& b);
  template <class T>
  T run(std::span<const T> variables) const;

  std::string text_;
  std::vector<Step> steps_;
};

}  // namespace phantom::geometry
