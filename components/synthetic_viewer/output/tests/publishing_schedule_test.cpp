#include "components/synthetic_viewer/output/publishing_schedule.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <vector>

namespace phantom::synthetic_viewer {
namespace {

using core::kNsPerMillisecond;
using core::kNsPerSecond;
using core::Nanoseconds;

constexpr Nanoseconds kBegin_ns = 5 * kNsPerSecond;
constexpr double kRate_hz = 30.0;

/// When what was due in turns of lengths that `next_turn` tells, with a view drawn just before each.
struct Published {
  std::vector<Nanoseconds> views, statuses;
};
template <class NextTurn>
Published published(PublishingSchedule schedule, Nanoseconds for_ns, const NextTurn& next_turn) {
  Published all;
  for (Nanoseconds now = kBegin_ns; now < kBegin_ns + for_ns; now += next_turn()) {
    const auto due = schedule.at(now, now - kNsPerMillisecond);
    if (due.view_pose) all.views.push_back(now);
    if (due.status) all.statuses.push_back(now);
  }
  return all;
}

void expect_gaps(const std::vector<Nanoseconds>& times, Nanoseconds least_ns, Nanoseconds most_ns) {
  ASSERT_GT(times.size(), 1u);
  for (std::size_t i = 1; i < times.size(); ++i) {
    EXPECT_GE(times[i] - times[i - 1], least_ns);
    EXPECT_LE(times[i] - times[i - 1], most_ns);
  }
}

TEST(PublishingSchedule, TellsTheViewTenTimesASecondAndTheStatusTwice) {
  const Published all = published(PublishingSchedule(true, kRate_hz), 10 * kNsPerSecond,
                                  [] { return PublishingSchedule::kViewPeriod_ns; });
  EXPECT_EQ(all.views.size(), 100u);
  EXPECT_EQ(all.statuses.size(), 20u);
}

// A window hands over whenever it likes.
TEST(PublishingSchedule, IsNeverMoreThanATurnLateNorTooOftenHoweverShortTurnsAre) {
  std::mt19937 random(7);
  constexpr Nanoseconds kMaxTurn_ns = 40 * kNsPerMillisecond;
  std::uniform_int_distribution<Nanoseconds> turn(1, kMaxTurn_ns);
  const Published all =
      published(PublishingSchedule(true, kRate_hz), 100 * kNsPerSecond, [&] { return turn(random); });
  expect_gaps(all.views, 100 * kNsPerMillisecond, 100 * kNsPerMillisecond + kMaxTurn_ns);
  expect_gaps(all.statuses, 500 * kNsPerMillisecond, 500 * kNsPerMillisecond + kMaxTurn_ns);
}

TEST(PublishingSchedule, WhatALateTurnMissedIsNotMadeUpFor) {
  PublishingSchedule schedule(true, kRate_hz);
  schedule.at(kBegin_ns, kBegin_ns);
  const Nanoseconds late = kBegin_ns + 3 * kNsPerSecond;
  EXPECT_TRUE(schedule.at(late, late).view_pose);
  const auto next = schedule.at(late + kNsPerMillisecond, late);
  EXPECT_FALSE(next.view_pose);
  EXPECT_FALSE(next.status);
}

TEST(PublishingSchedule, AViewThatIsNotYetOrWasDrawnLongAgoIsNotTold) {
  PublishingSchedule schedule(true, kRate_hz);
  EXPECT_FALSE(schedule.at(kNsPerSecond, 0).view_pose) << "a host that has just started";
  EXPECT_TRUE(schedule.at(kBegin_ns, kBegin_ns).view_pose) << "the first at once";
  EXPECT_TRUE(schedule.at(kBegin_ns + 2 * kNsPerSecond - 1, kBegin_ns).view_pose);
  const Nanoseconds later = kBegin_ns + 10 * kNsPerSecond;
  EXPECT_FALSE(schedule.at(later, later - 2 * kNsPerSecond).view_pose);
  EXPECT_TRUE(schedule.at(later, later).view_pose) << "a new one at once";
}

// Otherwise the listener would turn to and fro between two pictures.
TEST(PublishingSchedule, WherePicturesAreRareAViewCountsUntilTheSecondAfterItIsOverdue) {
  const Nanoseconds period = 5 * kNsPerSecond;
  PublishingSchedule schedule(true, 0.2);
  for (Nanoseconds age = 0; age < 2 * period; age += PublishingSchedule::kViewPeriod_ns)
    EXPECT_TRUE(schedule.at(kBegin_ns + age, kBegin_ns).view_pose) << age;
  EXPECT_FALSE(schedule.at(kBegin_ns + 2 * period, kBegin_ns).view_pose);
}

TEST(PublishingSchedule, AnOnlookersViewerTellsItsStatusOnly) {
  const Published all = published(PublishingSchedule(false, kRate_hz), 10 * kNsPerSecond,
                                  [] { return PublishingSchedule::kViewPeriod_ns; });
  EXPECT_TRUE(all.views.empty());
  EXPECT_EQ(all.statuses.size(), 20u);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
