#include "common/runtime/periodic_loop.hpp"

#include <gtest/gtest.h>
#include <pthread.h>

#include <cmath>
#include <optional>
#include <string>
#include <thread>

#include "common/core/clock.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::runtime {
namespace {

TEST(PeriodicLoop, TicksOnAbsoluteTimesAndNeverEarly) {
  PeriodicLoop loop("test", 0.002);
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
  PeriodicLoop loop("test", 0.001);
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
  PeriodicLoop loop("test", 0.0005);
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
  PeriodicLoop loop("test", 0.001, {.fifo_priority = 1});
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

TEST(PeriodicLoop, StopEndsIt) {
  PeriodicLoop loop("test", 0.001);
  int ticks = 0;
  loop.run([&](double) {
    if (++ticks == 5) loop.stop();
    return true;
  });
  EXPECT_EQ(ticks, 5);
}

}  // namespace
}  // namespace phantom::runtime
