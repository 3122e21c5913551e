#include "common/robot/sensing/worker_team.hpp"

#include <gtest/gtest.h>

#include <chrono>
#include <numeric>
#include <vector>

#include "tests/support/heap_guard.hpp"

namespace phantom::robot {
namespace {

/// What one part writes, on a cache line of its own.
struct alignas(64) Slot {
  std::size_t job = 0, calls = 0;
};

void expect_each_part_once(WorkerTeam& team, std::size_t jobs, std::size_t most_parts) {
  std::vector<Slot> slots(most_parts);
  for (std::size_t job = 1; job <= jobs; ++job) {
    const std::size_t parts = job * 7919 % (most_parts + 1);
    team.run(parts, [&slots, job](std::size_t part) {
      slots[part].job = job;
      ++slots[part].calls;
    });
    for (std::size_t part = 0; part < parts; ++part) ASSERT_EQ(slots[part].job, job) << "part " << part;
  }
  std::vector<std::size_t> expected(most_parts, 0);
  for (std::size_t job = 1; job <= jobs; ++job) {
    for (std::size_t part = 0; part < job * 7919 % (most_parts + 1); ++part) ++expected[part];
  }
  for (std::size_t part = 0; part < most_parts; ++part)
    EXPECT_EQ(slots[part].calls, expected[part]) << "part " << part;
}

TEST(WorkerTeam, DoesEachPartOfEachJobOnceWithAnyNumberOfThreads) {
  for (const std::size_t threads : {1U, 2U, 3U, 8U}) {
    WorkerTeam team(threads);
    EXPECT_EQ(team.threads(), threads);
    expect_each_part_once(team, 3000, 37);
  }
}

TEST(WorkerTeam, WakesWorkersThatHaveParked) {
  WorkerTeam team(3);
  for (int job = 0; job < 30; ++job) {
    std::this_thread::sleep_for(
        std::chrono::milliseconds(2));  // long enough to park, if they are quick; nothing rests on it
    std::vector<Slot> slots(20);
    team.run(slots.size(), [&slots](std::size_t part) { slots[part].calls = part + 1; });
    for (std::size_t part = 0; part < slots.size(); ++part) ASSERT_EQ(slots[part].calls, part + 1);
  }
}

TEST(WorkerTeam, SharesWithItsWorkers) {
  WorkerTeam team(2);
  const auto caller = std::this_thread::get_id();
  bool shared = false;
  // The caller holds its part until the other thread has taken one.
  for (int attempt = 0; attempt < 3 && !shared; ++attempt) {
    std::atomic<bool> other{false};
    const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    team.run(2, [&](std::size_t) {
      if (std::this_thread::get_id() != caller) other = true;
      while (!other && std::chrono::steady_clock::now() < give_up) std::this_thread::yield();
    });
    shared = other;
  }
  EXPECT_TRUE(shared);
}

TEST(WorkerTeam, AJobOfTooManyPartsIsDoneByTheCallerAlone) {
  WorkerTeam team(2);
  std::size_t calls = 0;
  const auto caller = std::this_thread::get_id();
  team.run(WorkerTeam::kMaxParts + 1,
           [&](std::size_t) { calls += std::this_thread::get_id() == caller ? 1U : 0U; });
  EXPECT_EQ(calls, WorkerTeam::kMaxParts + 1);
}

TEST(WorkerTeam, UsesNoHeapInAJob) {
  WorkerTeam team(2);
  std::vector<Slot> slots(50);
  for (int job = 0; job < 100; ++job) {
    const test::HeapGuard guard;
    team.run(slots.size(), [&slots](std::size_t part) {
      const test::HeapGuard in_worker;
      ++slots[part].calls;
    });
  }
  EXPECT_EQ(std::accumulate(slots.begin(), slots.end(), std::size_t{0},
                            [](std::size_t n, const Slot& s) { return n + s.calls; }),
            5000U);
}

}  // namespace
}  // namespace phantom::robot
