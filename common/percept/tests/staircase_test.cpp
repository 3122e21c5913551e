#include "common/percept/staircase.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "common/simulation/drag_observer.hpp"

namespace phantom::percept {
namespace {

constexpr double kReference = 1.7;  // any damping coefficient

/// Answers a comparison of two drags: whether the first is called greater.
using Observer = std::function<bool(double first, double second)>;

JustNoticeable measured(StaircaseParameters parameters, const Observer& observer) {
  Staircase staircase(parameters);
  while (const auto comparison = staircase.next()) {
    const double greater = kReference * (1.0 + comparison->fraction),
                 first = comparison->greater_first ? greater : kReference,
                 second = comparison->greater_first ? kReference : greater;
    staircase.answer(observer(first, second), std::log(first / second));
  }
  return staircase.result();
}

/// Standard deviation of ln θ that the answers of one comparison at the threshold leave at best (Cramér–Rao):
/// 1/√I with I = (dP/d ln θ)²/(P(1 − P)), P = λ/2 + (1 − λ)Φ(z).
double least_deviation(double share_right, double lapse_share) {
  double z = 0.0;
  const auto share = [&] { return 0.5 * lapse_share + (1.0 - lapse_share) * 0.5 * std::erfc(-z / M_SQRT2); };
  while (share() < share_right) z += 1e-5;
  const double slope = (1.0 - lapse_share) * z * std::exp(-0.5 * z * z) / std::sqrt(2.0 * M_PI);
  return std::sqrt(share_right * (1.0 - share_right)) / slope;
}

/// What many measurements of the same observer give.
struct Series {
  double covered = 0.0;  ///< share of the intervals that hold the true threshold
  double bias = 0.0, deviation = 0.0, reversals_bias = 0.0;  ///< of ln θ
  double trials = 0.0;                                       ///< on average
};

Series series(double truth, int right_to_descend, int runs) {
  Series sum;
  for (int run = 0; run < runs; ++run) {
    StaircaseParameters parameters{.right_to_descend = right_to_descend,
                                   .reversals = 16,
                                   .most_trials = 1000,
                                   .seed = static_cast<std::uint32_t>(run)};
    simulation::DragObserver observer(
        {ln_noise_of(truth, tracked_share(right_to_descend), parameters.lapse_share), parameters.lapse_share,
         static_cast<std::uint32_t>(run) + 100000U});
    const JustNoticeable found = measured(
        parameters, [&](double first, double second) { return observer.calls_first_greater(first, second); });
    const auto ln = [](double fraction) { return std::log(std::log1p(fraction)); };
    const double error = ln(found.fraction) - ln(truth);
    sum.covered += found.lower <= truth && truth <= found.upper ? 1.0 : 0.0;
    sum.bias += error;
    sum.deviation += error * error;
    sum.reversals_bias += ln(found.mean_of_reversals) - ln(truth);
    sum.trials += found.trials;
  }
  for (double* value : {&sum.covered, &sum.bias, &sum.deviation, &sum.reversals_bias, &sum.trials})
    *value /= runs;
  sum.deviation = std::sqrt(sum.deviation - sum.bias * sum.bias);
  return sum;
}

// Monte Carlo. Coverage: 0.95 within 3 standard deviations of the binomial distribution. Spread: not below
// what the answers can tell at best, were all at the most telling difference, and near what they tell at the
// threshold.
TEST(Staircase, FindsTheThresholdOfAKnownObserverWithinItsStatedUncertainty) {
  constexpr int kRuns = 400;
  const double margin = 3.0 * std::sqrt(0.95 * 0.05 / kRuns);
  for (const int right_to_descend : {2, 3})
    for (const double truth : {0.08, 0.2, 0.5}) {
      const Series found = series(truth, right_to_descend, kRuns);
      const double at_threshold =
          least_deviation(tracked_share(right_to_descend), 0.02) / std::sqrt(found.trials);
      const std::string place = std::to_string(right_to_descend) + " right, " + std::to_string(truth);
      std::printf(
          "%s: %.1f trials, covered %.3f, ln bias %.3f, deviation %.3f (at threshold %.3f), "
          "reversals' bias %.3f\n",
          place.c_str(), found.trials, found.covered, found.bias, found.deviation, at_threshold,
          found.reversals_bias);
      EXPECT_NEAR(found.covered, 0.95, margin) << place;
      EXPECT_LT(std::abs(found.bias), 0.5 * found.deviation) << place;
      EXPECT_GT(found.deviation, 0.5 * at_threshold) << place;
      EXPECT_LT(found.deviation, 1.35 * at_threshold) << place;
      EXPECT_LT(std::abs(found.reversals_bias), 0.2) << place;
    }
}

/// Calls the greater one if it is greater by more than a threshold, and otherwise the wrong one: without
/// chance, so that the course of the differences is known.
Observer certain(double least_fraction) {
  return [least_fraction](double first, double second) {
    const bool noticed = std::max(first, second) / std::min(first, second) - 1.0 > least_fraction;
    return noticed == (first > second);
  };
}

// Levitt's rule, worked by hand: three right answers make the difference smaller, one wrong one greater, by
// a factor of 2 until two reversals, then 1.4.
TEST(Staircase, GoesDownAfterThreeRightAnswersAndUpAfterOneWrong) {
  Staircase staircase({.first_fraction = 0.8, .coarse_reversals = 2, .reversals = 4});
  const auto observer = certain(0.3);
  std::vector<double> course;
  while (const auto comparison = staircase.next()) {
    course.push_back(comparison->fraction);
    const double greater = 1.0 + comparison->fraction;
    const double first = comparison->greater_first ? greater : 1.0,
                 second = comparison->greater_first ? 1.0 : greater;
    staircase.answer(observer(first, second), std::log(first / second));
  }
  const std::vector<double> wanted{0.8, 0.8, 0.8, 0.4,       0.4, 0.4, 0.2,
                                   0.4, 0.4, 0.4, 0.4 / 1.4, 0.4, 0.4, 0.4};
  ASSERT_EQ(course.size(), wanted.size());
  for (std::size_t i = 0; i < course.size(); ++i) EXPECT_NEAR(course[i], wanted[i], 1e-12) << i;
  EXPECT_TRUE(staircase.settled());
  EXPECT_EQ(staircase.result().reversals, 4);
}

TEST(Staircase, AnswersByChanceSettleNowhere) {
  for (std::uint32_t seed = 1; seed <= 50; ++seed) {
    Staircase staircase({.seed = seed});
    std::mt19937 coin(seed + 1000);
    while (const auto comparison = staircase.next()) {
      const double ln_ratio = std::log1p(comparison->fraction);
      staircase.answer((coin() & 0x8000U) != 0, comparison->greater_first ? ln_ratio : -ln_ratio);
    }
    EXPECT_FALSE(staircase.settled()) << seed;
  }
}

TEST(Staircase, TheOrderOfTheIntervalsIsRandomAndRepeatsWithItsSeed) {
  const auto orders = [](std::uint32_t seed) {
    Staircase staircase({.reversals = 1000, .most_trials = 400, .seed = seed});
    std::vector<bool> order;
    while (const auto comparison = staircase.next()) {
      order.push_back(comparison->greater_first);
      staircase.answer(comparison->greater_first, 0.1);
    }
    return order;
  };
  const auto one = orders(1);
  EXPECT_EQ(one, orders(1));
  EXPECT_NE(one, orders(2));
  const auto firsts = std::count(one.begin(), one.end(), true);
  EXPECT_NEAR(static_cast<double>(firsts), 200.0, 3.0 * std::sqrt(400 * 0.25));
}

TEST(Staircase, ParametersOutOfRangeAreRefusedByName) {
  EXPECT_TRUE(check_staircase({}));
  EXPECT_EQ(check_staircase({.right_to_descend = 1}).message(),
            "staircase: right_to_descend is 1; allowed: 2 to 5");
  EXPECT_EQ(check_staircase({.step = 1.0}).message(), "staircase: step is 1; allowed: 1.01 to 10");
  EXPECT_EQ(check_staircase({.first_fraction = std::nan("")}).message(),
            "staircase: first_fraction is nan; allowed: 0.001 to 10");
  EXPECT_FALSE(check_staircase({.coarse_reversals = 12, .reversals = 12}));
}

// 2^(−1/2) and 2^(−1/3), of Levitt's Table I.
TEST(Staircase, TracksTheSharesOfLevitt) {
  EXPECT_NEAR(tracked_share(2), 0.707, 5e-4);
  EXPECT_NEAR(tracked_share(3), 0.794, 5e-4);
}

}  // namespace
}  // namespace phantom::percept
