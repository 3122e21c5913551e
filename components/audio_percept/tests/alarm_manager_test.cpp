#include "components/audio_percept/alarm_manager.hpp"

#include <gtest/gtest.h>

#include <random>
#include <utility>
#include <vector>

#include "tests/support/heap_guard.hpp"

namespace phantom::audio_percept {
namespace {

using percept::Alarm;
using percept::burst_duration_s;

constexpr double kStep_s = 0.005;

/// A manager and what it let sound: begin of each burst in seconds, and whose.
struct Rig {
  AlarmRules rules;
  AlarmManager manager{rules};
  AlarmSet holding;
  double t_s = 0.0;
  std::vector<std::pair<double, Alarm>> bursts;
  std::vector<double> cuts_s;

  void set(Alarm alarm, bool holds) { holding[static_cast<std::size_t>(alarm)] = holds; }
  void run(double duration_s, bool acknowledge = false) {
    for (const double end_s = t_s + duration_s - 1e-9; t_s < end_s; t_s += kStep_s) {
      const auto change = manager.step(holding, acknowledge, kStep_s);
      acknowledge = false;
      if (change && *change != Alarm::kNone) bursts.emplace_back(t_s, *change);
      if (change && *change == Alarm::kNone) cuts_s.push_back(t_s);
    }
  }
  int count(Alarm alarm) const {
    int n = 0;
    for (const auto& burst : bursts) n += burst.second == alarm;
    return n;
  }
};

TEST(AlarmManager, IsSilentWhileNothingHolds) {
  Rig rig;
  rig.run(100.0);
  EXPECT_TRUE(rig.bursts.empty());
  EXPECT_EQ(rig.manager.active(), Alarm::kNone);
}

TEST(AlarmManager, WhatIsGraveSoundsAtOnce) {
  for (const Alarm alarm : {Alarm::kUnsafeMotion, Alarm::kDriveFault, Alarm::kEmergencyStop}) {
    Rig rig;
    rig.set(alarm, true);
    rig.run(0.006);
    ASSERT_EQ(rig.bursts.size(), 1U) << percept::name_of(alarm);
    EXPECT_EQ(rig.bursts[0], std::pair(0.0, alarm));
  }
}

TEST(AlarmManager, AShortLossDoesNotSound) {
  Rig rig;
  for (int i = 0; i < 50; ++i) {
    rig.set(Alarm::kLinkLost, true);
    rig.run(0.09);
    EXPECT_EQ(rig.manager.active(), Alarm::kNone);
    rig.set(Alarm::kLinkLost, false);
    rig.run(0.5);
  }
  EXPECT_TRUE(rig.bursts.empty());
  rig.set(Alarm::kLinkLost, true);
  rig.run(0.12);
  EXPECT_EQ(rig.count(Alarm::kLinkLost), 1);
}

TEST(AlarmManager, WhatLastsIsPromptAtFirstAndThenRare) {
  Rig rig;
  rig.set(Alarm::kEmergencyStop, true);
  rig.run(3600.0);
  ASSERT_GE(rig.bursts.size(), 5U);
  EXPECT_NEAR(rig.bursts[1].first - rig.bursts[0].first, rig.rules.high_repeat_s, 0.011);
  EXPECT_NEAR(rig.bursts[2].first - rig.bursts[1].first, rig.rules.high_repeat_s, 0.011);
  for (std::size_t i = 3; i < rig.bursts.size(); ++i)
    EXPECT_NEAR(rig.bursts[i].first - rig.bursts[i - 1].first, rig.rules.lasting_repeat_s, 0.011);
  EXPECT_LE(rig.bursts.size(), 3U + 3600 / 30);
}

TEST(AlarmManager, WhatIsAcknowledgedRepeatsRarelyFromThenOn) {
  Rig rig;
  rig.set(Alarm::kDriveFault, true);
  rig.run(1.0);
  rig.run(29.0, true);
  EXPECT_EQ(rig.bursts.size(), 1U);
  rig.run(2.0);
  EXPECT_EQ(rig.bursts.size(), 2U);
}

TEST(AlarmManager, AnAcknowledgementIsNotOneOfWhatComesLater) {
  Rig rig;
  rig.run(1.0, true);
  rig.set(Alarm::kDriveFault, true);
  rig.run(6.0);
  EXPECT_EQ(rig.bursts.size(), 2U);
  rig.set(Alarm::kDriveFault, false);
  rig.run(1.5, true);
  rig.set(Alarm::kDriveFault, true);
  rig.run(0.01);
  EXPECT_EQ(rig.bursts.size(), 3U) << "the next fault is news";
}

TEST(AlarmManager, AFlappingConditionIsHeldOff) {
  Rig rig;
  for (int i = 0; i < 300; ++i) {  // ten minutes
    rig.set(Alarm::kLinkLost, i % 2 == 0);
    rig.run(2.0);
  }
  EXPECT_LE(rig.bursts.size(), 3U + 600 / 30);
  EXPECT_GE(rig.bursts.size(), 10U) << "but it is heard";
}

TEST(AlarmManager, AFlappingGraveOneIsNoRattle) {
  Rig rig;
  for (int i = 0; i < 1000; ++i) {
    rig.set(Alarm::kDriveFault, i % 2 == 0);
    rig.run(0.05);
  }
  for (std::size_t i = 1; i < rig.bursts.size(); ++i)
    EXPECT_GE(rig.bursts[i].first - rig.bursts[i - 1].first, 1.0 - 1e-6);
}

TEST(AlarmManager, AfterALongAbsenceItBeginsAnew) {
  Rig rig;
  rig.set(Alarm::kLinkLost, true);
  rig.run(100.0);
  rig.set(Alarm::kLinkLost, false);
  rig.run(rig.rules.forget_s + 20.0);
  rig.bursts.clear();
  rig.set(Alarm::kLinkLost, true);
  rig.run(25.0);
  EXPECT_EQ(rig.bursts.size(), 3U) << "at 0, 10 and 20 s";
}

TEST(AlarmManager, TheGravestMasksTheOthersAndIsFollowedByThem) {
  Rig rig;
  rig.set(Alarm::kLinkLost, true);
  rig.set(Alarm::kEmergencyStop, true);
  rig.run(60.0);
  EXPECT_EQ(rig.count(Alarm::kLinkLost), 0);
  EXPECT_EQ(rig.manager.active(), Alarm::kEmergencyStop);
  rig.set(Alarm::kEmergencyStop, false);
  rig.run(5.0);
  EXPECT_EQ(rig.count(Alarm::kLinkLost), 1) << "it was not heard yet";
}

TEST(AlarmManager, AGraverOneBreaksIntoABurst) {
  Rig rig;
  rig.set(Alarm::kLinkLost, true);
  rig.run(0.3);
  ASSERT_EQ(rig.bursts.size(), 1U);
  rig.set(Alarm::kEmergencyStop, true);
  rig.run(0.01);
  ASSERT_EQ(rig.bursts.size(), 2U);
  EXPECT_EQ(rig.bursts[1].second, Alarm::kEmergencyStop);
}

TEST(AlarmManager, AGraveBurstEndsWithItsConditionALesserOneIsPlayedOut) {
  Rig rig;
  rig.set(Alarm::kEmergencyStop, true);
  rig.run(1.0);
  rig.set(Alarm::kEmergencyStop, false);
  rig.run(0.1);
  EXPECT_EQ(rig.cuts_s.size(), 1U);
  rig.set(Alarm::kWorkspaceStale, true);
  rig.run(0.5);
  EXPECT_EQ(rig.count(Alarm::kWorkspaceStale), 1);
  rig.set(Alarm::kWorkspaceStale, false);
  rig.run(2.0);
  EXPECT_EQ(rig.cuts_s.size(), 1U);
}

TEST(AlarmManager, InformationIsGivenOnce) {
  Rig rig;
  rig.set(Alarm::kMutedContact, true);
  rig.run(0.9);
  EXPECT_TRUE(rig.bursts.empty());
  rig.run(600.0);
  EXPECT_EQ(rig.bursts.size(), 1U);
}

TEST(AlarmManager, NeverMoreThanItsRulesAllowWhateverComes) {
  std::mt19937 random(7);
  Rig rig;
  for (int i = 0; i < 6000; ++i) {  // ten minutes of chaos
    for (std::size_t k = 1; k < percept::kAlarmCount; ++k)
      if (random() % 8 == 0) rig.holding.flip(k);
    rig.run(0.1, random() % 50 == 0);
  }
  ASSERT_GT(rig.bursts.size(), 20U);
  for (std::size_t i = 1; i < rig.bursts.size(); ++i) {
    const auto& [begin_s, alarm] = rig.bursts[i];
    const auto& [before_s, before] = rig.bursts[i - 1];
    if (alarm <= before && percept::priority_of(before) != percept::AlarmPriority::kHigh) {
      EXPECT_GE(begin_s - before_s, burst_duration_s(before) - 2 * kStep_s) << "only a graver one breaks in";
    }
    double last_s = -1e9;
    for (std::size_t k = 0; k < i; ++k)
      if (rig.bursts[k].second == alarm) last_s = rig.bursts[k].first;
    const double least_s = alarm == Alarm::kUnsafeMotion                                  ? 0.75
                           : percept::priority_of(alarm) == percept::AlarmPriority::kHigh ? 1.0
                                                                                          : 10.0;
    EXPECT_GE(begin_s - last_s, least_s - 2 * kStep_s) << percept::name_of(alarm);
  }
}

TEST(AlarmManager, UsesNoHeap) {
  AlarmManager manager{{}};
  AlarmSet all;
  all.set();
  const test::HeapGuard guard;
  for (int i = 0; i < 1000; ++i) manager.step(i % 100 < 50 ? all : AlarmSet{}, i % 77 == 0, kStep_s);
}

}  // namespace
}  // namespace phantom::audio_percept
