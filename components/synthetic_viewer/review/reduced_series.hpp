#pragma once

#include <cstddef>
#include <limits>
#include <vector>

#include "common/core/clock.hpp"

namespace phantom::synthetic_viewer {

/// A number over time, reduced to the least and the greatest value in each of equally long steps, so that a
/// plot of it needs no samples. Of bounded memory: when there would be more than kMax steps, two become one.
/// A plain value; pure.
class ReducedSeries {
 public:
  static constexpr std::size_t kMax = 65536;
  static constexpr core::Nanoseconds kFinest_ns = core::kNsPerMillisecond;  ///< length of a step at first

  /// The values in a stretch of time. Both are NaN if there is none.
  struct Span {
    float least = std::numeric_limits<float>::quiet_NaN();
    float greatest = std::numeric_limits<float>::quiet_NaN();
    void take(const Span& other) noexcept;
    friend bool operator==(const Span& a, const Span& b) noexcept;
  };

  explicit ReducedSeries(core::Nanoseconds begin_ns) : begin_ns_(begin_ns) {}

  /// Takes a value. One from before the beginning, or that is not finite, is left out.
  void take(core::Nanoseconds at_ns, double value);
  /// Returns the present length of a step.
  core::Nanoseconds step_ns() const noexcept { return step_ns_; }
  /// Returns the values in each of `count` columns that share the time from `from_ns` until `to_ns`: of all
  /// steps that overlap with the column. Empty if `count` is 0 or `to_ns` is not after `from_ns`.
  std::vector<Span> columns(core::Nanoseconds from_ns, core::Nanoseconds to_ns, std::size_t count) const;

 private:
  Span steps_over(core::Nanoseconds from_ns, core::Nanoseconds to_ns) const;

  core::Nanoseconds begin_ns_, step_ns_ = kFinest_ns;
  std::vector<Span> steps_;
};

}  // namespace phantom::synthetic_viewer
