#include "common/geometry/formula.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

namespace phantom::geometry {
namespace {

// As for intervals: NaN if either argument is NaN.
double least(double a, double b) { return std::isnan(a) || std::isnan(b) ? a + b : std::min(a, b); }
double most(double a, double b) { return std::isnan(a) || std::isnan(b) ? a + b : std::max(a, b); }
double power(double a, double b) { return std::isnan(a) || std::isnan(b) ? a + b : std::pow(a, b); }
Interval power(const Interval& a, const Interval& b) { return pow(a, b); }
Interval least(const Interval& a, const Interval& b) { return min(a, b); }
Interval most(const Interval& a, const Interval& b) { return max(a, b); }

}  // namespace

template <class T>
T Formula::of_one(Op op, const T& a) {
  using std::abs, std::acos, std::asin, std::atan, std::cos, std::cosh, std::exp, std::log, std::sin,
      std::sinh, std::sqrt, std::tan, std::tanh;
  switch (op) {
    case Op::kNegate:
      return -a;
    case Op::kSine:
      return sin(a);
    case Op::kCosine:
      return cos(a);
    case Op::kTangent:
      return tan(a);
    case Op::kArcSine:
      return asin(a);
    case Op::kArcCosine:
      return acos(a);
    case Op::kArcTangent:
      return atan(a);
    case Op::kSinh:
      return sinh(a);
    case Op::kCosh:
      return cosh(a);
    case Op::kTanh:
      return tanh(a);
    case Op::kExp:
      return exp(a);
    case Op::kLog:
      return log(a);
    case Op::kLog10:
      return log(a) * T(std::numbers::log10e);
    case Op::kRoot:
      return sqrt(a);
    case Op::kAbs:
      return abs(a);
    default:
      return a;
  }
}

template <class T>
T Formula::of_two(Op op, const T& a, const T& b) {
  using std::sqrt;
  switch (op) {
    case Op::kAdd:
      return a + b;
    case Op::kSubtract:
      return a - b;
    case Op::kMultiply:
      return a * b;
    case Op::kDivide:
      return a / b;
    case Op::kPower:
      return power(a, b);
    case Op::kMin:
      return least(a, b);
    case Op::kMax:
      return most(a, b);
    case Op::kLength:
      return sqrt(square(a) + square(b));
    default:
      return a;
  }
}

template <class T>
T Formula::run(std::span<const T> variables) const {
  std::array<T, kMaxDepth + 1> stack;
  std::size_t top = 0;  // entries in use
  for (const Step& step : steps_) {
    if (step.op == Op::kNumber || step.op == Op::kVariable) {
      stack[top++] = step.op == Op::kNumber ? T(step.number) : variables[step.variable];
    } else if (takes_two(step.op)) {
      --top;
      stack[top - 1] = of_two(step.op, stack[top - 1], stack[top]);
    } else {
      stack[top - 1] = of_one(step.op, stack[top - 1]);
    }
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
  using Op = Formula::Op;
  struct Function {
    const char* name;
    Op op;
    int arguments;  // exact number; −2: two or more
  };
  static constexpr std::size_t kMaxLength = 4096;
  static constexpr int kMaxNesting = 48;
  static constexpr const char* kOperators = "an operator (+ - * / ^) or the end";
  static constexpr Function kFunctions[] = {
      {"sin", Op::kSine, 1},     {"cos", Op::kCosine, 1},     {"tan", Op::kTangent, 1},
      {"asin", Op::kArcSine, 1}, {"acos", Op::kArcCosine, 1}, {"atan", Op::kArcTangent, 1},
      {"sinh", Op::kSinh, 1},    {"cosh", Op::kCosh, 1},      {"tanh", Op::kTanh, 1},
      {"exp", Op::kExp, 1},      {"log", Op::kLog, 1},        {"log10", Op::kLog10, 1},
      {"sqrt", Op::kRoot, 1},    {"abs", Op::kAbs, 1},        {"pow", Op::kPower, 2},
      {"min", Op::kMin, -2},     {"max", Op::kMax, -2},       {"length", Op::kLength, -2}};

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

  void emit(Op op, double number = 0.0, std::uint32_t variable = 0) {
    const bool leaf = op == Op::kNumber || op == Op::kVariable;
    if (leaf) ++depth_;
    if (!leaf && Formula::takes_two(op)) --depth_;
    if (depth_ > Formula::kMaxDepth || formula_.steps_.size() >= Formula::kMaxSteps)
      return fail(at_, "the formula is too large; allowed: " + std::to_string(Formula::kMaxSteps) +
                           " operations, " + std::to_string(Formula::kMaxDepth) + " open at a time");
    formula_.steps_.push_back({op, variable, number});
  }

  void sum() {
    product();
    while (!problem_) {
      if (take('+')) {
        product();
        emit(Op::kAdd);
      } else if (take('-')) {
        product();
        emit(Op::kSubtract);
      } else {
        return;
      }
    }
  }

  void product() {
    signed_power();
    while (!problem_) {
      if (take('*')) {
        signed_power();
        emit(Op::kMultiply);
      } else if (take('/')) {
        signed_power();
        emit(Op::kDivide);
      } else {
        return;
      }
    }
  }

  void signed_power() {
    if (problem_) return;
    if (++nesting_ > kMaxNesting)
      return fail(at_, "nested too deeply; allowed: " + std::to_string(kMaxNesting) + " levels");
    if (take('-')) {
      signed_power();
      emit(Op::kNegate);
    } else if (take('+')) {
      signed_power();
    } else {
      atom();
      if (take('^')) {
        signed_power();  // right-associative; the exponent may have a sign
        emit(Op::kPower);
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
    emit(Op::kNumber, value);
  }

  void name() {
    const std::size_t from = at_;
    while (at_ < text_.size() &&
           (std::isalnum(static_cast<unsigned char>(text_[at_])) != 0 || text_[at_] == '_'))
      ++at_;
    const std::string word = text_.substr(from, at_ - from);
    for (const Function& function : kFunctions) {
      if (word == function.name) return call(function, from);
    }
    const auto variable = std::find(variables_.begin(), variables_.end(), word);
    if (variable != variables_.end())
      return emit(Op::kVariable, 0.0, static_cast<std::uint32_t>(variable - variables_.begin()));
    if (word == "pi") return emit(Op::kNumber, std::numbers::pi);
    if (word == "e") return emit(Op::kNumber, std::numbers::e);
    std::string known;
    for (const std::string& candidate : variables_) known += candidate + " ";
    known += "pi e";
    for (const Function& function : kFunctions) known += std::string(" ") + function.name;
    fail(from, quoted(word.substr(0, 32)) + " is not known; allowed: " + known);
  }

  void call(const Function& function, std::size_t from) {
    if (!take('(')) return fail(at_, show(at_) + " stands after " + function.name + "; allowed: (");
    sum();
    int count = 1;
    for (; take(','); ++count) {
      sum();
      if (function.arguments < 0) emit(function.op);
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
    if (function.arguments > 0) emit(function.op);
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
