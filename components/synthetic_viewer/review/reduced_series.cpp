#include "components/synthetic_viewer/review/reduced_series.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::synthetic_viewer {

void ReducedSeries::Span::take(const Span& other) noexcept {
  least = std::fmin(least, other.least);  // of a number and NaN: the number
  greatest = std::fmax(greatest, other.greatest);
}

bool operator==(const ReducedSeries::Span& a, const ReducedSeries::Span& b) noexcept {
  const auto same = [](float x, float y) { return x == y || (std::isnan(x) && std::isnan(y)); };
  return same(a.least, b.least) && same(a.greatest, b.greatest);
}

void ReducedSeries::take(core::Nanoseconds at_ns, double value) {
  const auto shown = static_cast<float>(value);
  if (at_ns < begin_ns_ || !std::isfinite(shown)) return;
  const core::Nanoseconds since_ns = at_ns - begin_ns_;
  while (static_cast<std::size_t>(since_ns / step_ns_) >= kMax) {
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      const Span step = steps_[i];
      if (i % 2 == 0)
        steps_[i / 2] = step;
      else
        steps_[i / 2].take(step);
    }
    steps_.resize((steps_.size() + 1) / 2);
    step_ns_ *= 2;
  }
  const auto number = static_cast<std::size_t>(since_ns / step_ns_);
  if (number >= steps_.size()) steps_.resize(number + 1);
  steps_[number].take({shown, shown});
}

/// Returns the values of all steps that overlap with a stretch that is not empty.
ReducedSeries::Span ReducedSeries::steps_over(core::Nanoseconds from_ns, core::Nanoseconds to_ns) const {
  Span span;
  if (to_ns <= begin_ns_) return span;
  const core::Nanoseconds first = std::max<core::Nanoseconds>(0, from_ns - begin_ns_) / step_ns_;
  const core::Nanoseconds last = (to_ns - 1 - begin_ns_) / step_ns_;
  const auto size = static_cast<core::Nanoseconds>(steps_.size());
  for (core::Nanoseconds i = first; i <= last && i < size; ++i)
    span.take(steps_[static_cast<std::size_t>(i)]);
  return span;
}

std::vector<ReducedSeries::Span> ReducedSeries::columns(core::Nanoseconds from_ns, core::Nanoseconds to_ns,
                                                        std::size_t count) const {
  std::vector<Span> columns;
  if (to_ns <= from_ns || count == 0) return columns;
  // The borders share the time exactly, without a product that overflows.
  const auto parts = static_cast<core::Nanoseconds>(count);
  const core::Nanoseconds whole = (to_ns - from_ns) / parts, rest = (to_ns - from_ns) % parts;
  core::Nanoseconds begin = from_ns;
  for (core::Nanoseconds k = 1; k <= parts; ++k) {
    const core::Nanoseconds end = from_ns + whole * k + rest * k / parts;
    columns.push_back(steps_over(begin, std::max(end, begin + 1)));
    begin = end;
  }
  return columns;
}

}  // namespace phantom::synthetic_viewer
