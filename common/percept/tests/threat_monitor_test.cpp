#include "common/percept/threat_monitor.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <set>
#include <vector>

#include "tests/support/heap_guard.hpp"

namespace phantom::percept {
namespace {

using Changes = ThreatMonitor::Changes;

HitCandidate threat(std::uint32_t link, std::uint16_t object, double mu = 9.0, double speed_m_s = 0.3) {
  HitCandidate candidate;
  candidate.situation = {mu, speed_m_s, 0.9};
  candidate.link = link;
  candidate.object = object;
  return candidate;
}

class Threats : public testing::Test {
 protected:
  Changes step(const std::vector<HitCandidate>& threats, double dt_s = 0.01) {
    Changes changes;
    monitor_.step(threats, dt_s, changes);
    return changes;
  }
  ThreatMonitor monitor_{{}, {}};
};

TEST_F(Threats, SR20_EachLinkAndObjectHasAnAlertOfItsOwnAtOnce) {
  const Changes changes = step({threat(3, 1), threat(7, 1), threat(7, 2)});
  ASSERT_EQ(changes.raised.size(), 3U);
  EXPECT_TRUE(changes.cleared.empty());
  for (std::uint32_t i = 0; i < 3; ++i) EXPECT_EQ(changes.raised[i].number, i + 1) << "one running number";
  EXPECT_EQ(monitor_.active_count(), 3U);
  EXPECT_EQ(monitor_.alert_of(7, 2), 1U);
  EXPECT_EQ(monitor_.alert_of(3, 1), 3U) << "the most urgent last";
  EXPECT_EQ(monitor_.alert_of(3, 2), 0U);
  EXPECT_TRUE(step({threat(7, 2), threat(3, 1), threat(7, 1)}).empty()) << "in whatever order they come";
}

TEST_F(Threats, OneEndsWhileAnotherOneLasts) {
  step({threat(3, 1, 50.0), threat(7, 2)});
  for (int i = 0; i < 49; ++i) EXPECT_TRUE(step({threat(3, 1, 50.0)}).empty()) << i;
  const Changes changes = step({threat(3, 1, 50.0)}, 0.0101);
  ASSERT_EQ(changes.cleared.size(), 1U);
  EXPECT_EQ(changes.cleared[0].number, 1U);
  EXPECT_EQ(changes.cleared[0].at.link, 7U);
  EXPECT_EQ(monitor_.active_count(), 1U);
  EXPECT_EQ(monitor_.alert_of(3, 1), 2U);
}

TEST_F(Threats, ASpeedThatWaversDoesNotMakeOneFlicker) {
  const double limit_m_s = HitThresholds{}.limit.at(20.0);
  std::size_t raised = 0, cleared = 0;
  for (int i = 0; i < 400; ++i) {
    const Changes changes =
        step({threat(1, 1, 50.0), threat(2, 1, 20.0, limit_m_s * (i % 2 == 0 ? 1.05 : 0.8))});
    raised += changes.raised.size(), cleared += changes.cleared.size();
  }
  EXPECT_EQ(raised, 2U);
  EXPECT_EQ(cleared, 0U);
}

TEST_F(Threats, OneThatComesAndGoesIsRaisedNoMoreOftenThanTheLeastIntervalAndHoldsUpNoOther) {
  monitor_ = ThreatMonitor({}, {.clear_after_s = 0.001});
  std::size_t raised = 0;
  for (int i = 0; i < 1000; ++i)  // 10 s of on and off
    raised += step(i % 2 == 0 ? std::vector{threat(1, 1)} : std::vector<HitCandidate>{}).raised.size();
  EXPECT_LE(raised, 21U);
  EXPECT_GE(raised, 15U);
  EXPECT_EQ(step({threat(2, 1)}).raised.size(), 1U);
}

TEST_F(Threats, RuleOneRenewsTheAlertOfItsThreatAlone) {
  step({threat(1, 1), threat(2, 1)});
  const Changes changes = step({threat(1, 1), threat(2, 1, 50.0)}, 0.6);
  ASSERT_EQ(changes.raised.size(), 1U);
  ASSERT_EQ(changes.cleared.size(), 1U);
  EXPECT_EQ(changes.cleared[0].number, 1U);
  EXPECT_EQ(changes.raised[0].number, 3U);
  EXPECT_EQ(changes.raised[0].rule, HitRule::kVeryClose);
  EXPECT_EQ(monitor_.alert_of(1, 1), 2U);
}

TEST_F(Threats, SR20_AreBoundedAndTheMostUrgentComeFirst) {
  std::vector<HitCandidate> many;
  for (std::uint32_t link = 1; link <= ThreatMonitor::kMax + 4; ++link) many.push_back(threat(link, 1));
  const Changes first = step(many);
  EXPECT_EQ(first.raised.size(), ThreatMonitor::kMax);
  EXPECT_EQ(monitor_.alert_of(ThreatMonitor::kMax + 1, 1), 0U);
  EXPECT_TRUE(step(many).empty()) << "those that hold keep their places";
  // One no longer holds: its place goes to the next, and its alert ends with it.
  many.erase(many.begin() + 2);
  const Changes second = step(many);
  ASSERT_EQ(second.cleared.size(), 1U);
  EXPECT_EQ(second.cleared[0].at.link, 3U);
  ASSERT_EQ(second.raised.size(), 1U);
  EXPECT_EQ(second.raised[0].at.link, ThreatMonitor::kMax + 1);
}

TEST_F(Threats, AllEndAtOnceWhenNothingIsKnown) {
  step({threat(1, 1), threat(2, 3)});
  Changes changes;
  monitor_.close(changes);
  EXPECT_EQ(changes.cleared.size(), 2U);
  EXPECT_EQ(monitor_.active_count(), 0U);
  Changes none;
  monitor_.close(none);
  EXPECT_TRUE(none.empty());
}

TEST_F(Threats, SR20_WhateverComesEveryAlertIsRaisedOnceAndClearedOnceAndNothingIsAllocated) {
  std::mt19937 random(3);
  std::uniform_int_distribution<std::uint32_t> links(1, 12), count(0, 16);
  std::uniform_int_distribution<std::uint16_t> objects(1, 4);
  std::uniform_real_distribution<double> mu(0.0, 60.0), speed_m_s(0.0, 0.3);
  std::set<std::uint32_t> up;
  std::vector<HitCandidate> threats;
  threats.reserve(16);
  std::uint32_t newest = 0;
  for (int i = 0; i < 5000; ++i) {
    threats.clear();
    std::set<std::pair<std::uint32_t, std::uint16_t>> seen;
    for (std::uint32_t n = count(random); n > 0; --n) {
      const HitCandidate one = threat(links(random), objects(random), mu(random), speed_m_s(random));
      if (seen.insert({one.link, one.object}).second) threats.push_back(one);
    }
    Changes changes;
    {
      const test::HeapGuard no_heap;
      monitor_.step(threats, i % 7 == 0 ? std::nan("") : 0.1, changes);
    }
    for (const Alert& alert : changes.cleared) ASSERT_EQ(up.erase(alert.number), 1U);
    for (const Alert& alert : changes.raised) {
      ASSERT_EQ(alert.number, ++newest);
      up.insert(alert.number);
    }
    ASSERT_EQ(up.size(), monitor_.active_count());
    ASSERT_LE(up.size(), ThreatMonitor::kMax);
  }
  EXPECT_GT(newest, 100U);
}

}  // namespace
}  // namespace phantom::percept
