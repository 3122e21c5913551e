#pragma once

#include <array>
#include <cstdint>

namespace phantom::core {

/// Log-linear histogram of durations: fixed memory, constant cost, every quantile within 1/32 of its value.
/// Covers 0 ns to about 18 minutes; longer ones count in the last bin, the maximum stays exact.
/// Real-time safe: yes. Not thread-safe.
class DurationHistogram {
 public:
  void record(std::int64_t duration_ns) noexcept;
  void reset() noexcept { *this = {}; }
  /// Adds another histogram's counts.
  void merge(const DurationHistogram& other) noexcept;

  std::uint64_t count() const noexcept { return count_; }
  std::int64_t max_ns() const noexcept { return max_ns_; }
  double mean_ns() const noexcept { return count_ == 0 ? 0.0 : sum_ns_ / static_cast<double>(count_); }
  /// Returns the duration that a share `q` (0…1) of the recorded ones does not exceed, rounded up to its
  /// bin's edge; 0 if empty.
  std::int64_t quantile_ns(double q) const noexcept;

 private:
  static constexpr int kSubBits = 5;  // 32 linear bins per octave
  static constexpr int kOctaves = 36;
  static constexpr int kBins = (kOctaves + 1) << kSubBits;
  static int bin_of(std::int64_t duration_ns) noexcept;
  static std::int64_t upper_edge_ns(int bin) noexcept;

  std::array<std::uint64_t, kBins> bins_{};  // not 32 bits, which would overflow after 50 days at 1 kHz
  std::uint64_t count_ = 0;
  double sum_ns_ = 0.0;
  std::int64_t max_ns_ = 0;
};

}  // namespace phantom::core
