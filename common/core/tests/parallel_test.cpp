#include "common/core/parallel.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <barrier>
#include <map>
#include <mutex>
#include <set>
#include <stdexcept>
#include <thread>
#include <vector>

namespace phantom::core {
namespace {

TEST(ParallelFor, CallsEveryIndexOnceWithAWorkerThatHasOneThread) {
  for (const int threads : {-1, 0, 1, 2, 3, 8}) {
    for (const std::size_t count : {0U, 1U, 2U, 7U, 1000U}) {
      std::vector<std::atomic<int>> calls(count);
      std::mutex mutex;
      std::map<std::size_t, std::set<std::thread::id>> thread_of;
      parallel_for(threads, count, [&](std::size_t i, std::size_t worker) {
        ++calls[i];
        const std::lock_guard lock(mutex);
        thread_of[worker].insert(std::this_thread::get_id());
      });
      for (const auto& of_index : calls) EXPECT_EQ(of_index, 1);
      for (const auto& [worker, on] : thread_of) {
        EXPECT_LT(worker, static_cast<std::size_t>(std::max(1, threads)));
        EXPECT_EQ(on.size(), 1U);
        EXPECT_EQ(*on.begin() == std::this_thread::get_id(), worker == 0);
      }
    }
  }
}

TEST(ParallelFor, WorksOnAsManyThreadsAtOnceAsItIsTold) {
  constexpr int kThreads = 5;
  std::barrier all_here(kThreads);  // passed only if five are at work at the same time
  parallel_for(kThreads, kThreads, [&](std::size_t, std::size_t) { all_here.arrive_and_wait(); });
}

TEST(ParallelFor, KeepsItsThreadsForTheNextCall) {
  std::mutex mutex;
  std::set<pid_t> threads;  // the kernel's numbers: C++'s are given to the next thread
  for (int call = 0; call < 50; ++call) {
    std::barrier both(2);
    parallel_for(2, 2, [&](std::size_t, std::size_t worker) {
      both.arrive_and_wait();
      const std::lock_guard lock(mutex);
      if (worker > 0) threads.insert(gettid());
    });
  }
  EXPECT_LE(threads.size(), 7U);  // as many as any test of this file had beside its own: 8 workers
}

TEST(ParallelFor, ThrowsTheFirstFailureAndEndsTheRest) {
  for (const int threads : {1, 3}) {
    std::atomic<std::size_t> calls = 0;
    const auto work = [&](std::size_t i, std::size_t) {
      ++calls;
      if (i == 10) throw std::runtime_error("eleventh");
    };
    EXPECT_THROW(parallel_for(threads, std::size_t{1} << 40, work), std::runtime_error);
    EXPECT_GE(calls, 11U);
  }
}

TEST(ParallelFor, MayBeCalledWithinItselfAndFromSeveralThreads) {
  std::atomic<std::size_t> sum = 0;
  const auto nested = [&] {
    for (int round = 0; round < 200; ++round) {
      parallel_for(3, 3, [&](std::size_t, std::size_t) {
        parallel_for(4, 10, [&](std::size_t i, std::size_t) { sum += i; });
      });
    }
  };
  {
    const std::jthread second(nested), third(nested);
    nested();
  }
  EXPECT_EQ(sum, 3U * 200U * 3U * 45U);
}

}  // namespace
}  // namespace phantom::core
