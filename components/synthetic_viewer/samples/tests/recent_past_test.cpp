#include "components/synthetic_viewer/samples/recent_past.hpp"

#include <gtest/gtest.h>

#include "components/synthetic_viewer/samples/recent_samples.hpp"

namespace phantom::synthetic_viewer {
namespace {

constexpr core::Nanoseconds kMs = core::kNsPerMillisecond, kLong_ns = 250 * kMs;

ArmSample arm(core::Nanoseconds time_ns, double first_rad) {
  ArmSample sample;
  sample.received_ns = time_ns;
  sample.position[0] = first_rad;
  return sample;
}

TEST(RecentSamplesOfTheViewer, BetweenTwoSamplesTheArmIsBetweenThem) {
  RecentSamples past;
  past.arms.take(arm(1000 * kMs, 0.2));
  past.arms.take(arm(1040 * kMs, 0.6));
  EXPECT_DOUBLE_EQ(past.arm_at(1000 * kMs, kLong_ns).position[0], 0.2);
  EXPECT_NEAR(past.arm_at(1010 * kMs, kLong_ns).position[0], 0.3, 1e-12);
  EXPECT_EQ(past.arm_at(1010 * kMs, kLong_ns).received_ns, 1010 * kMs);
  EXPECT_DOUBLE_EQ(past.arm_at(1085 * kMs, kLong_ns).position[0], 0.6) << "still true";
}

TEST(RecentSamplesOfTheViewer, WhatWasNotHeardIsNotKnown) {
  RecentSamples past;
  EXPECT_EQ(past.arm_at(5 * kMs, kLong_ns).received_ns, 0);
  past.arms.take(arm(1000 * kMs, 0.2));
  past.arms.take(arm(2000 * kMs, 0.6));
  EXPECT_EQ(past.arm_at(999 * kMs, kLong_ns).received_ns, 0) << "before the first";
  EXPECT_EQ(past.arm_at(1500 * kMs, kLong_ns).received_ns, 0) << "the slave was silent then";
  EXPECT_EQ(past.arm_at(2060 * kMs, kLong_ns).received_ns, 0) << "after the last";
}

TEST(RecentSamplesOfTheViewer, AMinuteAtOneKilohertzTakesTheMemoryOfSixSecondsThinnedOut) {
  Past<ArmSample> past;
  for (core::Nanoseconds t = 0; t < 60000 * kMs; t += kMs) past.take(arm(t, 1e-9 * static_cast<double>(t)));
  EXPECT_FALSE(past.at(53000 * kMs, kLong_ns, kLong_ns));
  for (core::Nanoseconds t = 54100 * kMs; t < 59999 * kMs; t += 777777) {
    const auto around = past.at(t, kLong_ns, kLong_ns);
    ASSERT_TRUE(around);
    EXPECT_LE(around->after.received_ns - around->before.received_ns, 5 * kMs);
    const double between =
        around->before.position[0] + around->share * (around->after.position[0] - around->before.position[0]);
    EXPECT_NEAR(between, 1e-9 * static_cast<double>(t), 1e-9);
  }
  past.take(arm(10, 0.0));
  EXPECT_EQ(past.at(59999 * kMs, 0, kLong_ns)->before.received_ns, 59999 * kMs) << "time does not run back";
}

TEST(RecentSamplesOfTheViewer, ThePerceptMovesWithItsLinkAndDoesNotMixTwo) {
  RecentSamples past;
  PerceptSample percept;
  percept.valid = true;
  percept.link = 3;
  percept.received_ns = 100 * kMs;
  percept.position_m = {1, 0, 0};
  past.percepts.take(percept);
  percept.received_ns = 120 * kMs;
  percept.position_m = {2, 0, 0};
  past.percepts.take(percept);
  percept.link = 4;
  percept.received_ns = 140 * kMs;
  percept.position_m = {9, 0, 0};
  past.percepts.take(percept);
  EXPECT_NEAR(past.percept_at(110 * kMs, kLong_ns).position_m[0], 1.5, 1e-12);
  EXPECT_EQ(past.percept_at(130 * kMs, kLong_ns).position_m[0], 2.0);
  EXPECT_EQ(past.percept_at(130 * kMs, kLong_ns).link, 3U);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
