#include "components/synthetic_viewer/review/reduced_series.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace phantom::synthetic_viewer {
namespace {

using Span = ReducedSeries::Span;
constexpr core::Nanoseconds kBegin_ns = 1'700'000'000'000'000'000, kMs = core::kNsPerMillisecond;

struct Value {
  core::Nanoseconds at_ns;
  double value;
};

/// Takes all values whose step overlaps with the stretch, one by one.
Span literal(const std::vector<Value>& values, core::Nanoseconds step_ns, core::Nanoseconds from_ns,
             core::Nanoseconds to_ns) {
  Span span;
  for (const Value& value : values) {
    const core::Nanoseconds begin_ns = kBegin_ns + (value.at_ns - kBegin_ns) / step_ns * step_ns;
    if (begin_ns >= to_ns || begin_ns + step_ns <= from_ns) continue;
    const auto shown = static_cast<float>(value.value);
    if (!(span.least <= shown)) span.least = shown;
    if (!(span.greatest >= shown)) span.greatest = shown;
  }
  return span;
}

TEST(ReducedSeries, ColumnsAreThoseOfAllValuesOneByOne) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    std::mt19937 random(seed);
    const auto draw = [&](std::int64_t from, std::int64_t to) {
      return std::uniform_int_distribution<std::int64_t>(from, to)(random);
    };
    ReducedSeries series(kBegin_ns);
    std::vector<Value> values;
    const core::Nanoseconds length_ns = seed % 3 == 0   ? 500 * kMs
                                        : seed % 3 == 1 ? 60'000 * kMs
                                                        : 5'000'000 * kMs;
    for (int i = 0; i < 3000; ++i) {
      values.push_back({kBegin_ns + draw(0, length_ns), std::normal_distribution<>(0, 3)(random)});
      series.take(values.back().at_ns, values.back().value);
    }
    EXPECT_EQ(series.step_ns() > ReducedSeries::kFinest_ns, length_ns > 65536 * kMs);
    for (int k = 0; k < 40; ++k) {
      const core::Nanoseconds from_ns = kBegin_ns + draw(-length_ns / 4, length_ns);
      const core::Nanoseconds to_ns = from_ns + draw(1, k % 2 == 0 ? length_ns : length_ns / 50 + 7);
      const auto count = draw(1, 30);
      const auto columns = series.columns(from_ns, to_ns, static_cast<std::size_t>(count));
      ASSERT_EQ(columns.size(), static_cast<std::size_t>(count));
      for (std::int64_t c = 0; c < count; ++c) {
        const core::Nanoseconds begin_ns = from_ns + (to_ns - from_ns) * c / count;
        const core::Nanoseconds end_ns =
            std::max(begin_ns + 1, from_ns + (to_ns - from_ns) * (c + 1) / count);
        EXPECT_EQ(columns[static_cast<std::size_t>(c)], literal(values, series.step_ns(), begin_ns, end_ns))
            << "seed " << seed << ", column " << c << " of " << count;
      }
    }
  }
}

TEST(ReducedSeries, StaysBoundedWhateverTimesCome) {
  ReducedSeries series(kBegin_ns);
  series.take(kBegin_ns, 1.0);
  series.take(kBegin_ns + 4'000'000'000'000'000'000, 2.0);  // 127 years later
  EXPECT_LT(4'000'000'000'000'000'000 / series.step_ns(), static_cast<std::int64_t>(ReducedSeries::kMax));
  const auto columns = series.columns(kBegin_ns, kBegin_ns + 5'000'000'000'000'000'000, 5);
  EXPECT_EQ(columns[0], (Span{1.0F, 1.0F}));
  EXPECT_EQ(columns[1], Span());
  EXPECT_EQ(columns[4], (Span{2.0F, 2.0F}));
}

TEST(ReducedSeries, LeavesOutWhatIsNoNumberOrFromBefore) {
  ReducedSeries series(kBegin_ns);
  series.take(kBegin_ns - 1, 1.0);
  series.take(kBegin_ns, std::nan(""));
  series.take(kBegin_ns, std::numeric_limits<double>::infinity());
  series.take(kBegin_ns, 1e300);  // no float
  EXPECT_EQ(series.columns(kBegin_ns - kMs, kBegin_ns + kMs, 1)[0], Span());
  EXPECT_TRUE(series.columns(kBegin_ns, kBegin_ns, 3).empty());
  EXPECT_TRUE(series.columns(kBegin_ns, kBegin_ns + 1, 0).empty());
}

}  // namespace
}  // namespace phantom::synthetic_viewer
