#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/status.hpp"
#include "common/geometry/implicit/interval.hpp"

namespace phantom::geometry {

struct FormulaOperation;

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
  /// Returns the number of steps of one evaluation, at most kMaxSteps.
  std::size_t steps() const { return steps_.size(); }
  /// Returns what one evaluation costs in the time of bounds(), in sums or products: a function counts as
  /// kFunctionWork, a power and a length as twice that. At least steps().
  std::uint64_t work() const { return work_; }

  /// Greatest number of intermediate results and of steps of an evaluation.
  static constexpr std::size_t kMaxDepth = 64, kMaxSteps = 4096;
  /// Measured: bounds of a sum or product take 7 ns, of sin 60 ns, of pow 85 ns, of length 120 ns; values, as
  /// of sin, pow, and sin of huge numbers, a third of that and less.
  static constexpr std::uint64_t kFunctionWork = 4;

 private:
  friend class FormulaParser;
  struct Step {                                   // a step of a program in postfix order
    const FormulaOperation* operation = nullptr;  ///< null: a variable, or a number
    std::optional<std::uint32_t> variable = std::nullopt;
    double number = 0.0;
  };
  template <class T>
  T run(std::span<const T> variables) const;

  std::string text_;
  std::vector<Step> steps_;
  std::uint64_t work_ = 0;
};

}  // namespace phantom::geometry
