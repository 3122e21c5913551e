#include "common/geometry/implicit/formula.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

namespace phantom::geometry {

/// An operator or a function, for numbers and for intervals. Those of one argument ignore the second.
struct FormulaOperation {
  const char* name;
  int arguments;  ///< exact number; −2: two or more, applied to two at a time
  double (*of_numbers)(double a, double b);
  Interval (*of_intervals)(const Interval& a, const Interval& b);
  std::uint64_t work = 1;  ///< Formula::work()

  double operator()(double a, double b) const { return of_numbers(a, b); }
  Interval operator()(const Interval& a, const Interval& b) const { return of_intervals(a, b); }
};

namespace {

using Operation = FormulaOperation;

// As for intervals: NaN if either argument is NaN.
double least(double a, double b) { return std::isnan(a) || std::isnan(b) ? a + b : std::min(a, b); }
double most(double a, double b) { return std::isnan(a) || std::isnan(b) ? a + b : std::max(a, b); }
double power(double a, double b) { return std::isnan(a) || std::isnan(b) ? a + b : std::pow(a, b); }
Interval power(const Interval& a, const Interval& b) { return pow(a, b); }
Interval least(const Interval& a, const Interval& b) { return min(a, b); }
Interval most(const Interval& a, const Interval& b) { return max(a, b); }

using std::abs, std::acos, std::asin, std::atan, std::cos, std::cosh, std::exp, std::log, std::sin, std::sinh,
    std::sqrt, std::tan, std::tanh;

/// Makes an operation of a function that serves numbers and intervals.
template <class Function>
constexpr Operation operation(const char* name, int arguments, Function, std::uint64_t work = 1) {
  return {name, arguments, [](double a, double b) -> double { return Function{}(a, b); },
          [](const Interval& a, const Interval& b) -> Interval { return Function{}(a, b); }, work};
}

constexpr Operation kNegate = operation("-", 1, [](auto& a, auto&) { return -a; });
constexpr Operation kAdd = operation("+", 2, [](auto& a, auto& b) { return a + b; });
constexpr Operation kSubtract = operation("-", 2, [](auto& a, auto& b) { return a - b; });
constexpr Operation kMultiply = operation("*", 2, [](auto& a, auto& b) { return a * b; });
constexpr Operation kDivide = operation("/", 2, [](auto& a, auto& b) { return a / b; });
constexpr Operation kPower = operation(
    "pow", 2, [](auto& a, auto& b) { return power(a, b); }, 2 * Formula::kFunctionWork);
constexpr Operation kFunctions[] = {
    operation(
        "sin", 1, [](auto& a, auto&) { return sin(a); }, Formula::kFunctionWork),
    operation(
        "cos", 1, [](auto& a, auto&) { return cos(a); }, Formula::kFunctionWork),
    operation(
        "tan", 1, [](auto& a, auto&) { return tan(a); }, Formula::kFunctionWork),
    operation(
        "asin", 1, [](auto& a, auto&) { return asin(a); }, Formula::kFunctionWork),
    operation(
        "acos", 1, [](auto& a, auto&) { return acos(a); }, Formula::kFunctionWork),
    operation(
        "atan", 1, [](auto& a, auto&) { return atan(a); }, Formula::kFunctionWork),
    operation(
        "sinh", 1, [](auto& a, auto&) { return sinh(a); }, Formula::kFunctionWork),
    operation(
        "cosh", 1, [](auto& a, auto&) { return cosh(a); }, Formula::kFunctionWork),
    operation(
        "tanh", 1, [](auto& a, auto&) { return tanh(a); }, Formula::kFunctionWork),
    operation(
        "exp", 1, [](auto& a, auto&) { return exp(a); }, Formula::kFunctionWork),
    operation(
        "log", 1, [](auto& a, auto&) { return log(a); }, Formula::kFunctionWork),
    operation(
        "log10", 1, [](auto& a, auto&) { return log(a) * std::numbers::log10e; }, Formula::kFunctionWork),
    operation(
        "sqrt", 1, [](auto& a, auto&) { return sqrt(a); }, Formula::kFunctionWork),
    operation("abs", 1, [](auto& a, auto&) { return abs(a); }),
    kPower,
    operation("min", -2, [](auto& a, auto& b) { return least(a, b); }),
    operation("max", -2, [](auto& a, auto& b) { return most(a, b); }),
    operation(
        "length", -2, [](auto& a, auto& b) { return sqrt(square(a) + square(b)); },
        2 * Formula::kFunctionWork)};

}  // namespace

template <class T>
T Formula::run(std::span<const T> variables) const {
  std::array<T, kMaxDepth + 1> stack{};
  std::size_t top = 0;  // entries in use
  for (const Step& step : steps_) {
    if (step.operation == nullptr) {
      stack[top++] = step.variable ? variables[*step.variable] : T(step.number);
      continue;
    }
    if (step.operation->arguments != 1) --top;
    stack[top - 1] = (*step.operation)(stack[top - 1], stack[top]);
  }
  return stack[0];
}

double Formula::value(std::span<const double> variables) const { return run<double>(variables); }
Interval Formula::bounds(std::span<const Interval> variables) const { return run<Interval>(variables); }

/// Parses by recursive descent; the first error ends it.
class FormulaParser {
 public:
  FormulaParser(const std::string& text, const std::vector<std::string>& variables)
      : text_(text), variables_(variables) {
    formula_.text_ = text;
  }

  core::Expected<Formula> parse() {
    if (text_.size() > kMaxLength)
      fail(0, "the formula is too long; allowed: " + std::to_string(kMaxLength) + " characters");
    sum();
    skip_space();
    if (!problem_ && at_ < text_.size()) fail(at_, show(at_) + " is not expected; allowed: " + kOperators);
    if (problem_) return core::Status::invalid_argument(*problem_);
    return std::move(formula_);
  }

 private:
  static constexpr std::size_t kMaxLength = 4096;
  static constexpr int kMaxNesting = 48;
  static constexpr const char* kOperators = "an operator (+ - * / ^) or the end";

  void fail(std::size_t at, const std::string& what) {
    if (!problem_) problem_ = "column " + std::to_string(at + 1) + ": " + what;
  }
  static std::string quoted(const std::string& word) {
    std::string text(1, '\'');
    return text.append(word).append(1, '\'');
  }
  std::string show(std::size_t at) const {
    if (at >= text_.size()) return "the end";
    std::size_t end = at + 1;
    const auto word = [&](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
    while (word(text_[at]) && end < text_.size() && end < at + 32 && word(text_[end])) ++end;
    return quoted(text_.substr(at, end - at));
  }
  void skip_space() {
    while (at_ < text_.size() && std::isspace(static_cast<unsigned char>(text_[at_])) != 0) ++at_;
  }
  bool take(char c) {
    skip_space();
    if (problem_ || at_ >= text_.size() || text_[at_] != c) return false;
    ++at_;
    return true;
  }

  void emit(const Formula::Step& step) {
    if (step.operation == nullptr) ++depth_;
    if (step.operation != nullptr && step.operation->arguments != 1) --depth_;
    if (depth_ > Formula::kMaxDepth || formula_.steps_.size() >= Formula::kMaxSteps)
      return fail(at_, "the formula is too large; allowed: " + std::to_string(Formula::kMaxSteps) +
                           " operations, " + std::to_string(Formula::kMaxDepth) + " open at a time");
    formula_.steps_.push_back(step);
    formula_.work_ += step.operation == nullptr ? 1 : step.operation->work;
  }

  void sum() {
    product();
    while (!problem_) {
      const Operation* const operation = take('+') ? &kAdd : take('-') ? &kSubtract : nullptr;
      if (operation == nullptr) return;
      product();
      emit({operation});
    }
  }

  void product() {
    signed_power();
    while (!problem_) {
      const Operation* const operation = take('*') ? &kMultiply : take('/') ? &kDivide : nullptr;
      if (operation == nullptr) return;
      signed_power();
      emit({operation});
    }
  }

  void signed_power() {
    if (problem_) return;
    if (++nesting_ > kMaxNesting)
      return fail(at_, "nested too deeply; allowed: " + std::to_string(kMaxNesting) + " levels");
    if (take('-')) {
      signed_power();
      emit({&kNegate});
    } else if (take('+')) {
      signed_power();
    } else {
      atom();
      if (take('^')) {
        signed_power();  // right-associative; the exponent may have a sign
        emit({&kPower});
      }
    }
    --nesting_;
  }

  void atom() {
    skip_space();
    if (problem_) return;
    const char c = at_ < text_.size() ? text_[at_] : '\0';
    if (take('(')) {
      sum();
      if (!take(')'))
        fail(at_, show(at_) + " stands where a parenthesis must close; allowed: ) or an operator");
    } else if (std::isdigit(static_cast<unsigned char>(c)) != 0 || c == '.') {
      number();
    } else if (std::isalpha(static_cast<unsigned char>(c)) != 0) {
      name();
    } else {
      fail(at_, show(at_) + " is not expected; allowed: a number, a name, a sign or (");
    }
  }

  void number() {
    double value = 0.0;
    const char* const first = text_.data() + at_;
    const auto [end, error] = std::from_chars(first, text_.data() + text_.size(), value);
    if (error != std::errc{} || !std::isfinite(value))
      return fail(at_, show(at_) + " is not a number that can be held");
    at_ += static_cast<std::size_t>(end - first);
    emit({.number = value});
  }

  void name() {
    const std::size_t from = at_;
    while (at_ < text_.size() &&
           (std::isalnum(static_cast<unsigned char>(text_[at_])) != 0 || text_[at_] == '_'))
      ++at_;
    const std::string word = text_.substr(from, at_ - from);
    for (const Operation& function : kFunctions) {
      if (word == function.name) return call(function, from);
    }
    const auto variable = std::find(variables_.begin(), variables_.end(), word);
    if (variable != variables_.end())
      return emit({.variable = static_cast<std::uint32_t>(variable - variables_.begin())});
    if (word == "pi") return emit({.number = std::numbers::pi});
    if (word == "e") return emit({.number = std::numbers::e});
    std::string known;
    for (const std::string& candidate : variables_) known += candidate + " ";
    known += "pi e";
    for (const Operation& function : kFunctions) known += std::string(" ") + function.name;
    fail(from, quoted(word.substr(0, 32)) + " is not known; allowed: " + known);
  }

  void call(const Operation& function, std::size_t from) {
    if (!take('(')) return fail(at_, show(at_) + " stands after " + function.name + "; allowed: (");
    sum();
    int count = 1;
    for (; take(','); ++count) {
      sum();
      if (function.arguments < 0) emit({&function});
    }
    if (!take(')'))
      return fail(at_, show(at_) + " stands among the arguments of " + function.name + "; allowed: , or )");
    const bool wrong = function.arguments < 0 ? count < 2 : count != function.arguments;
    if (wrong) {
      const int needed = std::abs(function.arguments);
      return fail(from, std::string(function.name) + " has " + std::to_string(count) +
                            " arguments; allowed: " + std::to_string(needed) +
                            (function.arguments < 0 ? " or more" : ""));
    }
    if (function.arguments > 0) emit({&function});
  }

  const std::string& text_;
  const std::vector<std::string>& variables_;
  Formula formula_;
  std::optional<std::string> problem_;
  std::size_t at_ = 0;
  std::size_t depth_ = 0;
  int nesting_ = 0;
};

core::Expected<Formula> Formula::parse(const std::string& text, const std::vector<std::string>& variables) {
  return FormulaParser(text, variables).parse();
}

}  // namespace phantom::geometry
