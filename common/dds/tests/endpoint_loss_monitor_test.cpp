#include "common/dds/arbitration/endpoint_loss_monitor.hpp"

#include <gtest/gtest.h>

#include "common/dds/tests/prefixes.hpp"

namespace phantom::dds {
namespace {

const GuidPrefix kOwn = prefix(5), kPeer = prefix(9);

// A peer with ends 1 to 3 that was lost at 10 s, as Fast DDS tells it: its ends first.
EndpointLossMonitor after_a_loss() {
  EndpointLossMonitor watch;
  watch.discovered(kPeer, 1 * kS);
  for (EndpointLossMonitor::End end = 1; end <= 3; ++end) watch.end_discovered(kPeer, end, 1 * kS);
  for (EndpointLossMonitor::End end = 1; end <= 3; ++end) watch.end_removed(kPeer, end, 10 * kS);
  watch.left(kPeer, 10 * kS);
  return watch;
}

TEST(EndpointLossMonitor, WhoReturnsWholeIsLetBe) {
  EndpointLossMonitor watch = after_a_loss();
  EXPECT_TRUE(watch.overdue(kOwn, 1000 * kS).empty()) << "it is gone";
  watch.discovered(kPeer, 20 * kS);
  EXPECT_TRUE(watch.overdue(kOwn, 20 * kS + EndpointLossMonitor::kPatience - 1).empty());
  for (EndpointLossMonitor::End end = 1; end <= 3; ++end) watch.end_discovered(kPeer, end, 20 * kS);
  EXPECT_TRUE(watch.overdue(kOwn, 1000 * kS).empty());
}

TEST(EndpointLossMonitor, WithWhoeverReturnsWithoutSomeEndsItIsBegunAnewUntilTheyAreThere) {
  EndpointLossMonitor watch = after_a_loss();
  watch.discovered(kPeer, 20 * kS);
  watch.end_discovered(kPeer, 2, 20 * kS);
  const auto first = watch.overdue(kOwn, 20 * kS + EndpointLossMonitor::kPatience);
  ASSERT_EQ(first.size(), 1u);
  EXPECT_EQ(first[0].peer, kPeer);
  EXPECT_EQ(first[0].number, 1);
  EXPECT_EQ(first[0].missing, 2u);
  EXPECT_TRUE(watch.overdue(kOwn, 20 * kS + 2 * EndpointLossMonitor::kPatience).empty()) << "twice as long";
  const auto second = watch.overdue(kOwn, 20 * kS + 3 * EndpointLossMonitor::kPatience);
  ASSERT_EQ(second.size(), 1u);
  EXPECT_EQ(second[0].number, 2);
  watch.end_discovered(kPeer, 1, 40 * kS);
  watch.end_discovered(kPeer, 3, 40 * kS);
  EXPECT_TRUE(watch.overdue(kOwn, 10000 * kS).empty());
}

TEST(EndpointLossMonitor, WaitsWhileEndsCome) {
  EndpointLossMonitor watch = after_a_loss();
  watch.discovered(kPeer, 20 * kS);
  watch.end_discovered(kPeer, 1, 22 * kS);
  EXPECT_TRUE(watch.overdue(kOwn, 20 * kS + EndpointLossMonitor::kPatience).empty());
  EXPECT_EQ(watch.overdue(kOwn, 22 * kS + EndpointLossMonitor::kPatience).size(), 1u);
}

TEST(EndpointLossMonitor, TheGreaterWaitsLonger) {
  EndpointLossMonitor watch = after_a_loss();
  watch.discovered(kPeer, 20 * kS);
  const GuidPrefix greater = prefix(10);
  EXPECT_TRUE(watch.overdue(greater, 20 * kS + EndpointLossMonitor::kPatience).empty());
  EXPECT_EQ(watch.overdue(greater, 20 * kS + EndpointLossMonitor::kPatience * 3 / 2).size(), 1u);
}

TEST(EndpointLossMonitor, WaitsForWhoeverHasNotBeenAdmittedYet) {
  EndpointLossMonitor watch = after_a_loss();
  EXPECT_TRUE(watch.overdue(kOwn, 1000 * kS).empty());
  EXPECT_TRUE(watch.left(kPeer, 1000 * kS)) << "it left again without";
  watch.discovered(kPeer, 1001 * kS);
  EXPECT_EQ(watch.overdue(kOwn, 1001 * kS + EndpointLossMonitor::kPatience).size(), 1u);
}

TEST(EndpointLossMonitor, WhatWasClosedMeanwhileIsGivenUp) {
  EndpointLossMonitor watch = after_a_loss();
  watch.discovered(kPeer, 20 * kS);
  int attempts = 0;
  for (int s = 20; s < 3600; ++s) attempts += static_cast<int>(watch.overdue(kOwn, s * kS).size());
  EXPECT_EQ(attempts, EndpointLossMonitor::kMaxAttempts);
}

TEST(EndpointLossMonitor, AnEndThatWasClosedBeforeTheLossIsNotMissed) {
  EndpointLossMonitor watch;
  watch.discovered(kPeer, 0);
  watch.end_discovered(kPeer, 1, 1 * kS);
  watch.end_removed(kPeer, 1, 5 * kS);
  watch.left(kPeer, 10 * kS);
  watch.discovered(kPeer, 20 * kS);
  EXPECT_TRUE(watch.overdue(kOwn, 1000 * kS).empty());
}

TEST(EndpointLossMonitor, AnEndOfItThatIsToldAfterItsReturnChangesNothing) {
  EndpointLossMonitor watch;
  watch.discovered(kPeer, 0);
  watch.end_discovered(kPeer, 1, 1 * kS);
  watch.discovered(kPeer, 10 * kS);
  watch.end_removed(kPeer, 1, 10 * kS);
  watch.left(kPeer, 10 * kS);
  ASSERT_EQ(watch.overdue(kOwn, 10 * kS + EndpointLossMonitor::kPatience).size(), 1u)
      << "it is there, its end is not";
}

TEST(EndpointLossMonitor, ForgetsWhoWasLostFirst) {
  EndpointLossMonitor watch = after_a_loss();
  for (std::size_t other = 0; other < EndpointLossMonitor::kMaxLost; ++other) {
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
