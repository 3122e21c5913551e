#include "common/core/histogram.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

namespace phantom::core {
namespace {

TEST(DurationHistogram, QuantilesAgreeWithSortedSamplesWithinABin) {
  std::mt19937_64 random(7);
  std::lognormal_distribution<double> durations(11.0, 2.0);
  DurationHistogram histogram;
  std::vector<std::int64_t> samples;
  for (int i = 0; i < 20'000; ++i) {
    samples.push_back(static_cast<std::int64_t>(durations(random)));
    histogram.record(samples.back());
  }
  std::sort(samples.begin(), samples.end());
  for (const double q : {0.01, 0.5, 0.9, 0.99, 0.999}) {
    const auto exact = samples[static_cast<std::size_t>(std::ceil(q * 20'000.0)) - 1];
    EXPECT_GE(histogram.quantile_ns(q), exact);
    EXPECT_LE(static_cast<double>(histogram.quantile_ns(q)),
              static_cast<double>(exact) * (1.0 + 1.0 / 32.0) + 1.0);
  }
  EXPECT_EQ(histogram.max_ns(), samples.back());
  EXPECT_EQ(histogram.quantile_ns(1.0), samples.back());
}

TEST(DurationHistogram, SmallDurationsAreExactAndHugeOnesDoNotOverflow) {
  DurationHistogram histogram;
  EXPECT_EQ(histogram.quantile_ns(0.5), 0);
  histogram.record(5);
  EXPECT_EQ(histogram.quantile_ns(0.5), 5);
  histogram.record(INT64_MAX);
  EXPECT_EQ(histogram.max_ns(), INT64_MAX);
  histogram.record(-3);
  EXPECT_EQ(histogram.count(), 3u);
  EXPECT_EQ(histogram.quantile_ns(0.01), 0);
}

TEST(DurationHistogram, MergeEqualsRecordingAll) {
  DurationHistogram a, b, all;
  for (int i = 1; i < 1000; ++i) {
    (i % 3 ? a : b).record(i * i);
    all.record(i * i);
  }
  a.merge(b);
  EXPECT_EQ(a.count(), all.count());
  EXPECT_EQ(a.quantile_ns(0.9), all.quantile_ns(0.9));
  EXPECT_DOUBLE_EQ(a.mean_ns(), all.mean_ns());
}

// A servo at 1 kHz fills 32 bits within 50 days.
TEST(DurationHistogram, CountsForYears) {
  DurationHistogram histogram;
  histogram.record(1000);
  for (int doubled = 0; doubled < 34; ++doubled) histogram.merge(DurationHistogram(histogram));
  EXPECT_EQ(histogram.count(), std::uint64_t{1} << 34);
  histogram.record(50'000);
  EXPECT_EQ(histogram.quantile_ns(0.5), histogram.quantile_ns(0.0));
  EXPECT_LT(histogram.quantile_ns(0.99), 1100);
}

}  // namespace
}  // namespace phantom::core
