#include "common/core/histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace phantom::core {

int DurationHistogram::bin_of(std::int64_t duration_ns) noexcept {
  const auto value = static_cast<std::uint64_t>(std::max<std::int64_t>(duration_ns, 0));
  const int shift = std::max(0, static_cast<int>(std::bit_width(value)) - (kSubBits + 1));
  const int bin = (shift << kSubBits) + static_cast<int>(value >> shift);
  return std::min(bin, kBins - 1);
}

std::int64_t DurationHistogram::upper_edge_ns(int bin) noexcept {
  const int shift = std::max(0, (bin >> kSubBits) - 1);
  const std::int64_t mantissa = bin - (static_cast<std::int64_t>(shift) << kSubBits);
  return ((mantissa + 1) << shift) - 1;
}

void DurationHistogram::record(std::int64_t duration_ns) noexcept {
  ++bins_[static_cast<std::size_t>(bin_of(duration_ns))];
  ++count_;
  sum_ns_ += static_cast<double>(std::max<std::int64_t>(duration_ns, 0));
  max_ns_ = std::max(max_ns_, duration_ns);
}

void DurationHistogram::merge(const DurationHistogram& other) noexcept {
  for (std::size_t i = 0; i < bins_.size(); ++i) bins_[i] += other.bins_[i];
  count_ += other.count_;
  sum_ns_ += other.sum_ns_;
  max_ns_ = std::max(max_ns_, other.max_ns_);
}

std::int64_t DurationHistogram::quantile_ns(double q) const noexcept {
  if (count_ == 0) return 0;
  const auto rank =
      static_cast<std::uint64_t>(std::ceil(std::clamp(q, 0.0, 1.0) * static_cast<double>(count_)));
  std::uint64_t seen = 0;
  for (int bin = 0; bin < kBins; ++bin) {
    seen += bins_[static_cast<std::size_t>(bin)];
    if (seen >= std::max<std::uint64_t>(rank, 1)) return std::min(upper_edge_ns(bin), max_ns_);
  }
  return max_ns_;
}

}  // namespace phantom::core
