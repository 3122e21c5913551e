#include "common/teleop/guards/loop_guard.hpp"

#include <gtest/gtest.h>

#include <deque>
#include <random>

#include "tests/support/heap_guard.hpp"

namespace phantom::teleop {
namespace {

constexpr LoopGuardParameters kGuarded{
    .period_s = 0.002, .late_limit_s = 0.01, .window_s = 1.0, .most_late_s = 0.06};

struct LoopRun {
  LoopGuard guard{kGuarded};
  core::Nanoseconds now_ns = 1;
  LoopPace pace;

  LoopPace after(double away_s) {
    const test::HeapGuard no_heap;
    return pace = guard.tick(now_ns += core::from_seconds(away_s));
  }
  void on_time(double duration_s) {
    for (double t = 0.0; t < duration_s; t += kGuarded.period_s) after(kGuarded.period_s);
  }
};

TEST(LoopGuard, APunctualLoopIsNeverLateOrStarvedAndLosesNoGain) {
  LoopRun run;
  EXPECT_FALSE(run.after(0.0).late) << "before the first tick nothing was away";
  for (int i = 0; i < 5000; ++i) {
    run.after(kGuarded.period_s * (i % 2 == 0 ? 0.6 : 1.4));
    ASSERT_FALSE(run.pace.late || run.pace.starved);
    ASSERT_EQ(run.pace.share_within(kPunctual * kGuarded.period_s), 1.0);
  }
}

TEST(LoopGuard, SR18_TheTimeThatTorquesActFollowsAGapAtOnceAndIsForgottenSlowly) {
  LoopRun run;
  run.on_time(0.5);
  EXPECT_TRUE(run.after(0.04).late);
  EXPECT_DOUBLE_EQ(run.pace.held_s, 0.04);
  EXPECT_DOUBLE_EQ(run.pace.share_within(0.004), 0.1);
  EXPECT_FALSE(run.after(kGuarded.period_s).late);
  run.on_time(0.2);
  EXPECT_NEAR(run.pace.held_s, 0.04 - 0.02, 0.001);
  run.on_time(0.4);
  EXPECT_DOUBLE_EQ(run.pace.held_s, kGuarded.period_s);
}

TEST(LoopGuard, SR18_OneShortGapIsBorneAndOneLongGapOrManyStarve) {
  LoopRun run;
  run.on_time(1.0);
  EXPECT_FALSE(run.after(0.05).starved);
  run.on_time(1.1);
  EXPECT_TRUE(run.after(0.065).starved);
  EXPECT_EQ(run.pace.late_ticks, 1U);
  EXPECT_DOUBLE_EQ(run.pace.longest_gap_s, 0.065);
  run.on_time(1.1);
  EXPECT_FALSE(run.pace.starved) << "on schedule for the whole window";
  for (int i = 1; i <= 4; ++i) {
    EXPECT_FALSE(run.pace.starved) << i;
    run.after(0.02);
    run.on_time(0.1);
  }
  EXPECT_TRUE(run.pace.starved) << "four times 18 ms late";
  EXPECT_EQ(run.pace.late_ticks, 4U);
  EXPECT_DOUBLE_EQ(run.pace.longest_gap_s, 0.02);
}

TEST(LoopGuard, SR18_AStarvedLoopIsWellAgainOnceMostOfTheLateTimeHasLeftTheWindow) {
  LoopRun run;
  run.on_time(1.0);
  run.after(0.05);
  run.on_time(0.5);
  ASSERT_TRUE(run.after(0.05).starved);
  run.on_time(0.35);
  EXPECT_TRUE(run.pace.starved) << "96 ms late, within the last 0.9 s";
  run.on_time(0.2);
  EXPECT_TRUE(run.pace.starved) << "the 48 ms that are left are more than half of what is allowed";
  run.on_time(0.5);
  EXPECT_FALSE(run.pace.starved);
}

TEST(LoopGuard, SR18_ALoopThatIsAlwaysLateStaysStarved) {
  LoopRun run;
  run.on_time(0.1);
  for (int i = 0; i < 200; ++i) run.after(0.015);
  EXPECT_TRUE(run.pace.starved);
  run.after(100.0);
  EXPECT_TRUE(run.pace.starved) << "a gap longer than the window is late time in it";
  EXPECT_DOUBLE_EQ(run.pace.held_s, 100.0);
  run.on_time(1.1);
  EXPECT_FALSE(run.pace.starved);
}

// Any pattern: against a window that is kept tick by tick. The guard's slides by a twentieth at a time.
TEST(LoopGuard, SR18_AgreesWithAWindowThatForgetsNothingWhateverThePattern) {
  std::mt19937 chance(7);
  for (int pattern = 0; pattern < 50; ++pattern) {
    LoopRun run;
    std::deque<std::pair<core::Nanoseconds, double>> late;
    std::exponential_distribution<double> more_s(1.0 / (0.0005 + 0.0002 * pattern));
    const double slot_s = kGuarded.window_s / 20;
    run.after(0.0);
    for (int i = 0; i < 3000; ++i) {
      const double away_s = core::seconds(core::from_seconds(kGuarded.period_s + more_s(chance)));
      const bool was_starved = run.pace.starved;
      run.after(away_s);
      if (away_s > kGuarded.late_limit_s) late.emplace_back(run.now_ns, away_s - kGuarded.period_s);
      const auto within = [&](double last_s) {
        double sum_s = 0.0;
        for (const auto& [then_ns, s] : late) sum_s += core::seconds(run.now_ns - then_ns) < last_s ? s : 0.0;
        return sum_s;
      };
      const double most_s = was_starved ? 0.5 * kGuarded.most_late_s : kGuarded.most_late_s;
      if (within(kGuarded.window_s - slot_s - away_s) > most_s + 1e-9) {
        ASSERT_TRUE(run.pace.starved) << pattern << ", tick " << i;
      }
      if (within(kGuarded.window_s + slot_s + away_s) < most_s - 1e-9) {
        ASSERT_FALSE(run.pace.starved) << pattern << ", tick " << i;
      }
      ASSERT_GE(run.pace.held_s, away_s);
    }
  }
}

}  // namespace
}  // namespace phantom::teleop
