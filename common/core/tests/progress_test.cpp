#include "common/core/progress.hpp"

#include <gtest/gtest.h>

namespace phantom::core {
namespace {

constexpr Nanoseconds kStart = 1'000 * kNsPerSecond, kMs = kNsPerMillisecond;

TEST(Progress, TheRateIsThatOfTheLastSecond) {
  Progress loop("servo", 0.001);
  loop.begin(kStart);
  for (int i = 1; i <= 5'000; ++i) loop.tick(kStart + i * kMs);
  EXPECT_NEAR(loop.statistics(kStart + 5'000 * kMs).rate_hz, 1000.0, 1.0);
  for (int i = 1; i <= 200; ++i) loop.tick(kStart + (5'000 + 10 * i) * kMs);  // 100 Hz for two seconds
  EXPECT_NEAR(loop.statistics(kStart + 7'000 * kMs).rate_hz, 100.0, 1.0)
      << "what came before the last second does not count";
  EXPECT_EQ(loop.statistics(kStart + 7'000 * kMs).ticks, 5'200u);
}

TEST(Progress, ALoopThatStandsStillHasNoRateAndTellsForHowLong) {
  Progress loop("servo", 0.001, 1.0);
  loop.begin(kStart);
  for (int i = 1; i <= 3'000; ++i) loop.tick(kStart + i * kMs);
  const LoopStatistics soon = loop.statistics(kStart + 3'900 * kMs);
  EXPECT_NEAR(soon.idle_s, 0.9, 1e-9);
  EXPECT_FALSE(hangs(soon));
  const LoopStatistics later = loop.statistics(kStart + 15'000 * kMs);
  EXPECT_EQ(later.rate_hz, 0.0);
  EXPECT_NEAR(later.idle_s, 12.0, 1e-9);
  EXPECT_TRUE(hangs(later));
}

TEST(Progress, InItsFirstSecondTheRateIsThatSinceItBegan) {
  Progress loop("servo", 0.001);
  loop.begin(kStart);
  for (int i = 1; i <= 250; ++i) loop.tick(kStart + i * kMs);
  EXPECT_NEAR(loop.statistics(kStart + 250 * kMs).rate_hz, 1000.0, 1.0);
}

TEST(Progress, AThreadThatHasBegunMustTickButOneThatHasNotNeedNot) {
  Progress loop("servo");
  EXPECT_FALSE(hangs(loop.statistics(kStart + 100 * kNsPerSecond)));
  loop.begin(kStart);
  EXPECT_TRUE(hangs(loop.statistics(kStart + 2 * kNsPerSecond))) << "it never came to its first tick";
}

TEST(Progress, AThreadThatRestsOrHasEndedDoesNotHang) {
  Progress loop("page");
  loop.tick(kStart);
  loop.rest();
  EXPECT_FALSE(hangs(loop.statistics(kStart + 100 * kNsPerSecond)));
  loop.tick(kStart + 100 * kNsPerSecond);
  EXPECT_TRUE(hangs(loop.statistics(kStart + 102 * kNsPerSecond)));
  loop.end(kStart + 102 * kNsPerSecond);
  EXPECT_FALSE(hangs(loop.statistics(kStart + 200 * kNsPerSecond)));
}

TEST(Progress, AnEndedLoopHasTheRateOfItsLastSecond) {
  Progress loop("servo", 0.001);
  loop.begin(kStart);
  for (int i = 1; i <= 3'000; ++i) loop.tick(kStart + i * kMs);
  loop.end(kStart + 3'000 * kMs);
  EXPECT_NEAR(loop.statistics(kStart + 9'000 * kMs).rate_hz, 1000.0, 1.0);
}

TEST(Health, ALoopThatHangsIsAFaultThatSaysWhichAndForHowLong) {
  Health health{ComponentState::kRunning, "coupled", {}, {}};
  health.loops = {{.name = "servo", .idle_s = 3.21, .limit_s = 1.0},
                  {.name = "publisher", .idle_s = 0.1, .limit_s = 1.0}};
  const Health faulty = with_hung_loops(health);
  EXPECT_EQ(faulty.state, ComponentState::kFault);
  EXPECT_EQ(faulty.message, "the servo loop has not run for 3.2 s; coupled");
  EXPECT_TRUE(any_hangs(faulty));
  health.loops[1].idle_s = 7.0;
  EXPECT_EQ(with_hung_loops(health).message,
            "the servo loop has not run for 3.2 s; the publisher loop has not run for 7.0 s; coupled");
  health.loops = {{.name = "bare_loop", .idle_s = 100.0, .limit_s = 0.0}};
  EXPECT_EQ(with_hung_loops(health).state, ComponentState::kRunning) << "what has no limit cannot hang";
  EXPECT_EQ(with_hung_loops(health).message, "coupled");
}

}  // namespace
}  // namespace phantom::core
