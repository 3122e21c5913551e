#include "common/runtime/servo/periodic_loop.hpp"

#include <gtest/gtest.h>
#include <pthread.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <thread>

#include "common/core/clock.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::runtime {
namespace {

TEST(PeriodicLoop, TicksOnAbsoluteTimesAndNeverEarly) {
  PeriodicLoop loop("test", 0.002, core::ThreadRole::kServo);
  const auto start = core::monotonic_ns();
  int ticks = 0;
  double elapsed_s = 0.0;
  loop.run([&](double dt_s) {
    elapsed_s += dt_s;
    EXPECT_GE(core::seconds(core::monotonic_ns() - start), elapsed_s - 1e-9)
        << "a tick never comes before its due time";
    EXPECT_NEAR(dt_s / 0.002, std::round(dt_s / 0.002), 1e-6) << "dt is a whole number of periods";
    return ++ticks < 100;
  });
  const auto statistics = loop.statistics();
  EXPECT_EQ(statistics.ticks, 100u);
  // Time that passed = periods ticked + periods slipped (all but what slipped in the last tick).
  EXPECT_NEAR(elapsed_s, 0.002 * static_cast<double>(100 + statistics.slips), 1e-9);
}

TEST(PeriodicLoop, AnOverrunSkipsDueTimesInsteadOfCatchingUp) {
  PeriodicLoop loop("test", 0.001, core::ThreadRole::kServo);
  int ticks = 0;
  loop.run([&](double dt_s) {
    if (ticks == 1) {
      EXPECT_GE(dt_s, 0.0199) << "the tick after an overrun of 20 ms covers it in one step";
    }
    if (++ticks == 1) {
      const auto until = core::monotonic_ns() + 20 * core::kNsPerMillisecond;
      while (core::monotonic_ns() < until) {
      }
    }
    return ticks < 3;
  });
  EXPECT_GE(loop.statistics().slips, 19u);
  EXPECT_GE(loop.statistics().work_max_us, 20'000.0);
}

TEST(PeriodicLoop, AllocatesNothingOnceItRuns) {
  PeriodicLoop loop("test", 0.0005, core::ThreadRole::kServo);
  int ticks = 0;
  std::optional<test::HeapGuard> guard;
  loop.run([&](double) {
    if (!guard) guard.emplace();  // from the first tick on, publishing the statistics included
    return ++ticks < 2100;
  });
  guard.reset();
  EXPECT_EQ(ticks, 2100);
}

// While it runs, not only at its end: a person must know early that slips are to be expected.
TEST(PeriodicLoop, SaysAtItsStartThatRealTimePriorityWasRefused) {
  const auto granted = [] {
    bool yes = false;
    std::thread([&] {
      sched_param parameters{};
      parameters.sched_priority = 1;
      yes = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters) == 0;
    }).join();
    return yes;
  }();
  PeriodicLoop loop("test", 0.001, core::ThreadRole::kServo, {.servo_priority = 1});
  std::string notice;
  std::thread([&] {
    loop.run([&](double) {
      notice = loop.notice();
      return false;
    });
  }).join();
  EXPECT_EQ(notice.empty(), granted) << notice;
  if (!granted) {
    EXPECT_NE(notice.find("CAP_SYS_NICE"), std::string::npos);
  }
}

TEST(PeriodicLoop, ABodyThatHangsIsSeenFromOutsideWithoutItsHelp) {
  PeriodicLoop loop("servo", 0.001, core::ThreadRole::kServo);
  std::atomic<bool> hang{false}, go_on{true};
  std::thread thread([&] {
    loop.run([&](double) {
      while (hang && go_on) std::this_thread::yield();
      return go_on.load();
    });
  });
  while (loop.statistics().ticks < 100) std::this_thread::yield();
  hang = true;
  core::LoopStatistics seen = loop.statistics();
  while (!core::hangs(seen)) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    seen = loop.statistics();
    ASSERT_LT(seen.idle_s, 10.0);
  }
  EXPECT_GT(seen.idle_s, core::Progress::kHangsAfter_s);
  while (loop.statistics().idle_s < 1.2) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(loop.statistics().rate_hz, 0.0) << "none of its ticks is of the last second";
  go_on = false;
  thread.join();
  EXPECT_FALSE(core::hangs(loop.statistics())) << "it has ended in order";
}

TEST(PeriodicLoop, StopEndsIt) {
  PeriodicLoop loop("test", 0.001, core::ThreadRole::kServo);
  int ticks = 0;
  loop.run([&](double) {
    if (++ticks == 5) loop.stop();
    return true;
  });
  EXPECT_EQ(ticks, 5);
}

}  // namespace
}  // namespace phantom::runtime
