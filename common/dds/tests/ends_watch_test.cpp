#include "common/dds/arbitration/ends_watch.hpp"

#include <gtest/gtest.h>

#include "common/dds/tests/prefixes.hpp"

namespace phantom::dds {
namespace {

const GuidPrefix kOwn = prefix(5), kPeer = prefix(9);

// A peer with ends 1 to 3 that was lost at 10 s, as Fast DDS tells it: its ends first.
EndsWatch after_a_loss() {
  EndsWatch watch;
  watch.discovered(kPeer, 1 * kS);
  for (EndsWatch::End end = 1; end <= 3; ++end) watch.end_discovered(kPeer, end, 1 * kS);
  for (EndsWatch::End end = 1; end <= 3; ++end) watch.end_removed(kPeer, end, 10 * kS);
  watch.left(kPeer, 10 * kS);
  return watch;
}

TEST(EndsWatch, WhoReturnsWholeIsLetBe) {
  EndsWatch watch = after_a_loss();
  EXPECT_TRUE(watch.overdue(kOwn, 1000 * kS).empty()) << "it is gone";
  watch.discovered(kPeer, 20 * kS);
  EXPECT_TRUE(watch.overdue(kOwn, 20 * kS + EndsWatch::kPatience - 1).empty());
  for (EndsWatch::End end = 1; end <= 3; ++end) watch.end_discovered(kPeer, end, 20 * kS);
  EXPECT_TRUE(watch.overdue(kOwn, 1000 * kS).empty());
}

TEST(EndsWatch, WithWhoeverReturnsWithoutSomeEndsItIsBegunAnewUntilTheyAreThere) {
  EndsWatch watch = after_a_loss();
  watch.discovered(kPeer, 20 * kS);
  watch.end_discovered(kPeer, 2, 20 * kS);
  const auto first = watch.overdue(kOwn, 20 * kS + EndsWatch::kPatience);
  ASSERT_EQ(first.size(), 1u);
  EXPECT_EQ(first[0].peer, kPeer);
  EXPECT_EQ(first[0].number, 1);
  EXPECT_EQ(first[0].missing, 2u);
  EXPECT_TRUE(watch.overdue(kOwn, 20 * kS + 2 * EndsWatch::kPatience).empty()) << "twice as long";
  const auto second = watch.overdue(kOwn, 20 * kS + 3 * EndsWatch::kPatience);
  ASSERT_EQ(second.size(), 1u);
  EXPECT_EQ(second[0].number, 2);
  watch.end_discovered(kPeer, 1, 40 * kS);
  watch.end_discovered(kPeer, 3, 40 * kS);
  EXPECT_TRUE(watch.overdue(kOwn, 10000 * kS).empty());
}

TEST(EndsWatch, WaitsWhileEndsCome) {
  EndsWatch watch = after_a_loss();
  watch.discovered(kPeer, 20 * kS);
  watch.end_discovered(kPeer, 1, 22 * kS);
  EXPECT_TRUE(watch.overdue(kOwn, 20 * kS + EndsWatch::kPatience).empty());
  EXPECT_EQ(watch.overdue(kOwn, 22 * kS + EndsWatch::kPatience).size(), 1u);
}

TEST(EndsWatch, TheGreaterWaitsLonger) {
  EndsWatch watch = after_a_loss();
  watch.discovered(kPeer, 20 * kS);
  const GuidPrefix greater = prefix(10);
  EXPECT_TRUE(watch.overdue(greater, 20 * kS + EndsWatch::kPatience).empty());
  EXPECT_EQ(watch.overdue(greater, 20 * kS + EndsWatch::kPatience * 3 / 2).size(), 1u);
}

TEST(EndsWatch, WaitsForWhoeverHasNotBeenAdmittedYet) {
  EndsWatch watch = after_a_loss();
  EXPECT_TRUE(watch.overdue(kOwn, 1000 * kS).empty());
  EXPECT_TRUE(watch.left(kPeer, 1000 * kS)) << "it left again without";
  watch.discovered(kPeer, 1001 * kS);
  EXPECT_EQ(watch.overdue(kOwn, 1001 * kS + EndsWatch::kPatience).size(), 1u);
}

TEST(EndsWatch, WhatWasClosedMeanwhileIsGivenUp) {
  EndsWatch watch = after_a_loss();
  watch.discovered(kPeer, 20 * kS);
  int attempts = 0;
  for (int s = 20; s < 3600; ++s) attempts += static_cast<int>(watch.overdue(kOwn, s * kS).size());
  EXPECT_EQ(attempts, EndsWatch::kMostAttempts);
}

TEST(EndsWatch, AnEndThatWasClosedBeforeTheLossIsNotMissed) {
  EndsWatch watch;
  watch.discovered(kPeer, 0);
  watch.end_discovered(kPeer, 1, 1 * kS);
  watch.end_removed(kPeer, 1, 5 * kS);
  watch.left(kPeer, 10 * kS);
  watch.discovered(kPeer, 20 * kS);
  EXPECT_TRUE(watch.overdue(kOwn, 1000 * kS).empty());
}

TEST(EndsWatch, AnEndOfItThatIsToldAfterItsReturnChangesNothing) {
  EndsWatch watch;
  watch.discovered(kPeer, 0);
  watch.end_discovered(kPeer, 1, 1 * kS);
  watch.discovered(kPeer, 10 * kS);
  watch.end_removed(kPeer, 1, 10 * kS);
  watch.left(kPeer, 10 * kS);
  ASSERT_EQ(watch.overdue(kOwn, 10 * kS + EndsWatch::kPatience).size(), 1u) << "it is there, its end is not";
}

TEST(EndsWatch, ForgetsWhoWasLostFirst) {
  EndsWatch watch = after_a_loss();
  for (std::size_t other = 0; other < EndsWatch::kMostLost; ++other) {
    const GuidPrefix lost{1, static_cast<std::uint8_t>(other), static_cast<std::uint8_t>(other >> 8)};
    watch.discovered(lost, 11 * kS);
    watch.left(lost, 12 * kS);
  }
  watch.discovered(kPeer, 20 * kS);
  EXPECT_TRUE(watch.overdue(kOwn, 1000 * kS).empty());
  EXPECT_EQ(watch.forgotten(), 1U);
}

}  // namespace
}  // namespace phantom::dds
