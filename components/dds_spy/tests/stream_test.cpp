#include "components/dds_spy/stream.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

namespace phantom::dds_spy {
namespace {

SampleFacts sample(std::uint64_t number, core::Nanoseconds received_ns) {
  SampleFacts facts;
  facts.sequence_number = number;
  facts.received_ns = received_ns;
  facts.received_utc_ns = received_ns + 1'000'000'000'000;
  facts.octets = 100;
  return facts;
}

/// Literal twin: keeps everything, then counts by the definitions.
struct Twin {
  std::vector<SampleFacts> all;

  std::vector<double> periods() const {
    std::vector<double> list;
    for (std::size_t i = 1; i < all.size(); ++i)
      list.push_back(1e-9 * static_cast<double>(all[i].received_ns - all[i - 1].received_ns));
    return list;
  }
  static double mean(const std::vector<double>& list) {
    double sum = 0;
    for (const double value : list) sum += value;
    return sum / static_cast<double>(list.size());
  }
  static double deviation(const std::vector<double>& list) {
    double sum = 0;
    for (const double value : list) sum += (value - mean(list)) * (value - mean(list));
    return std::sqrt(sum / static_cast<double>(list.size()));
  }
  static double quantile(std::vector<double> list, double q) {
    std::sort(list.begin(), list.end());
    return list[static_cast<std::size_t>(std::ceil(q * static_cast<double>(list.size()))) - 1];
  }
};

TEST(Stream, FiguresEqualTheLiteralOnesOfARandomStream) {
  std::mt19937_64 random(3);
  std::lognormal_distribution<double> period_ms(0.0, 0.5), age_us(4.0, 1.0);
  std::bernoulli_distribution lost(0.05);
  Stream stream;
  Twin twin;
  std::vector<double> ages;
  std::uint64_t number = 1, missing = 0, gaps = 0, largest = 0, run = 0;
  core::Nanoseconds now_ns = 5'000'000'000;
  for (int i = 0; i < 5000; ++i, ++number) {
    now_ns += static_cast<core::Nanoseconds>(1e6 * period_ms(random));
    if (i > 0 && lost(random)) {
      ++run;
      continue;
    }
    SampleFacts facts = sample(number, now_ns);
    facts.octets = 50 + random() % 100;
    const auto age_ns = static_cast<core::Nanoseconds>(1e3 * age_us(random));
    facts.stamp = SampleStamp{number, now_ns - age_ns, 0, 77};
    facts.same_host = true;
    ages.push_back(1e-9 * static_cast<double>(age_ns));
    EXPECT_EQ(stream.take(facts).missing, run);
    missing += run;
    gaps += run > 0 ? 1 : 0;
    largest = std::max(largest, run);
    run = 0;
    twin.all.push_back(facts);
  }
  const StreamFigures f = stream.figures();
  const auto periods = twin.periods();
  EXPECT_EQ(f.samples, twin.all.size());
  EXPECT_NEAR(f.rate_hz, 1.0 / Twin::mean(periods), 1e-9 * f.rate_hz);
  EXPECT_NEAR(f.period_mean_s, Twin::mean(periods), 1e-12);
  EXPECT_NEAR(f.jitter_s, Twin::deviation(periods), 1e-12);
  EXPECT_DOUBLE_EQ(f.period_min_s, *std::min_element(periods.begin(), periods.end()));
  EXPECT_DOUBLE_EQ(f.period_max_s, *std::max_element(periods.begin(), periods.end()));
  EXPECT_NEAR(f.period_p99_s, Twin::quantile(periods, 0.99), f.period_p99_s / 31) << "the histogram's width";
  EXPECT_EQ(f.missing, missing);
  EXPECT_EQ(f.gaps, gaps);
  EXPECT_EQ(f.largest_gap, largest);
  EXPECT_EQ(f.skipped, 0u) << "numbers that were lost on the way were not left out by the writer";
  EXPECT_EQ(f.clock, LatencyClock::kMonotonic);
  EXPECT_NEAR(f.latency_mean_s, Twin::mean(ages), 1e-12);
  EXPECT_NEAR(f.latency_p50_s, Twin::quantile(ages, 0.5), f.latency_p50_s / 31);
  EXPECT_NEAR(f.latency_p99_s, Twin::quantile(ages, 0.99), f.latency_p99_s / 31);
  EXPECT_DOUBLE_EQ(f.latency_max_s, *std::max_element(ages.begin(), ages.end()));
  EXPECT_DOUBLE_EQ(f.latency_min_s, *std::min_element(ages.begin(), ages.end()));
}

TEST(Stream, OneSampleHasNoRate) {
  Stream stream;
  stream.take(sample(9, 1));
  const auto f = stream.figures();
  EXPECT_EQ(f.samples, 1u);
  EXPECT_EQ(f.rate_hz, 0.0);
  EXPECT_EQ(f.missing, 0u) << "what was sent before the first is not missed";
  EXPECT_EQ(f.clock, LatencyClock::kNone);
}

TEST(Stream, NumbersThatTheWriterLeftOutAreToldFromLostSamples) {
  Stream stream;
  const auto take = [&](std::uint64_t number, std::uint64_t stamp_number, std::uint64_t session = 1) {
    auto facts = sample(number, static_cast<core::Nanoseconds>(number) * core::kNsPerMillisecond);
    facts.stamp = SampleStamp{stamp_number, 0, 0, session};
    return stream.take(facts);
  };
  take(1, 10);
  EXPECT_EQ(take(2, 14).skipped, 3u);
  const auto both = take(5, 18);  // two lost, one left out
  EXPECT_EQ(both.missing, 2u);
  EXPECT_EQ(both.skipped, 1u);
  EXPECT_TRUE(take(6, 1, 2).restarted);
  const auto f = stream.figures();
  EXPECT_EQ(f.skipped, 4u);
  EXPECT_EQ(f.restarts, 1u);
}

TEST(Stream, OutOfOrderSamplesAndDisposalsMakeNoGap) {
  Stream stream;
  stream.take(sample(1, 1 * core::kNsPerMillisecond));
  stream.take_number(2);
  EXPECT_EQ(stream.take(sample(3, 2 * core::kNsPerMillisecond)).missing, 0u);
  stream.take(sample(3, 3 * core::kNsPerMillisecond));
  EXPECT_EQ(stream.figures().out_of_order, 1u);
  stream.forget_sequence();
  EXPECT_EQ(stream.take(sample(90, 4 * core::kNsPerMillisecond)).missing, 0u);
}

TEST(Stream, AcrossHostsUtcClocksAreComparedAndANegativeAgeIsKept) {
  Stream stamped, foreign;
  auto facts = sample(1, 5 * core::kNsPerMillisecond);
  facts.stamp = SampleStamp{1, 0, facts.received_utc_ns + 2 * core::kNsPerMillisecond, 1};
  stamped.take(facts);
  EXPECT_EQ(stamped.figures().clock, LatencyClock::kStampUtc);
  EXPECT_EQ(stamped.figures().negative_latencies, 1u);
  EXPECT_DOUBLE_EQ(stamped.figures().latency_min_s, -0.002);
  facts.stamp.reset();
  facts.source_ns = facts.received_utc_ns - 3 * core::kNsPerMillisecond;
  foreign.take(facts);
  EXPECT_EQ(foreign.figures().clock, LatencyClock::kSourceTimestamp);
  EXPECT_DOUBLE_EQ(foreign.figures().latency_max_s, 0.003);
}

TEST(Stream, TimesThatCannotBeAreToldAsTheyAre) {
  constexpr auto kMin = std::numeric_limits<core::Nanoseconds>::min();
  Stream stream;
  SampleFacts odd = sample(1, 100 * core::kNsPerMillisecond);
  odd.stamp = SampleStamp{};
  for (const bool same_host : {true, false}) {
    odd.same_host = same_host;
    odd.stamp->monotonic_ns = odd.stamp->utc_ns = kMin;
    stream.take(odd);
    EXPECT_GT(stream.figures().latency_max_s, 9e9);
    ++odd.sequence_number;
  }
  odd.stamp.reset();
  odd.source_ns = kMin;
  stream.take(odd);
  EXPECT_GT(stream.figures().latency_min_s, 9e9);

  DeadlineWatch watch(20 * core::kNsPerMillisecond);
  watch.take(100 * core::kNsPerMillisecond, kMin);
  const auto miss = watch.take(200 * core::kNsPerMillisecond, 1);
  ASSERT_TRUE(miss);
  EXPECT_GT(miss->made_apart_ns, 0);
}

TEST(DeadlineWatch, CountsPeriodsWithoutASample) {
  DeadlineWatch watch(20 * core::kNsPerMillisecond);
  EXPECT_FALSE(watch.take(100 * core::kNsPerMillisecond, 0));
  EXPECT_FALSE(watch.take(120 * core::kNsPerMillisecond, 0)) << "just in time";
  const auto miss = watch.take(185 * core::kNsPerMillisecond, 0);
  ASSERT_TRUE(miss);
  EXPECT_EQ(miss->periods, 3u);
  EXPECT_EQ(miss->pause_ns, 65 * core::kNsPerMillisecond);
  EXPECT_FALSE(miss->reported);
  EXPECT_EQ(watch.missed(), 3u);
}

TEST(DeadlineWatch, ASilenceIsToldOnceAndItsEndToo) {
  DeadlineWatch watch(20 * core::kNsPerMillisecond);
  EXPECT_FALSE(watch.look(1000 * core::kNsPerMillisecond)) << "the deadline begins with the first sample";
  watch.take(1000 * core::kNsPerMillisecond, 5 * core::kNsPerMillisecond);
  EXPECT_FALSE(watch.look(1020 * core::kNsPerMillisecond));
  EXPECT_TRUE(watch.look(1021 * core::kNsPerMillisecond));
  EXPECT_FALSE(watch.look(1500 * core::kNsPerMillisecond));
  const auto end = watch.take(1600 * core::kNsPerMillisecond, 6 * core::kNsPerMillisecond);
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->reported);
  EXPECT_EQ(end->made_apart_ns, 1 * core::kNsPerMillisecond)
      << "the writer was in time: it was held up on the way";
}

}  // namespace
}  // namespace phantom::dds_spy
