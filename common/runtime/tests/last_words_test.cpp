#include "common/runtime/process/last_words.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <pthread.h>
#include <unistd.h>

#include <csignal>
#include <functional>
#include <stdexcept>
#include <thread>

namespace phantom::runtime {
namespace {

void dies_in_its_thread(const std::function<void()>& work) {
  leave_last_words("drummer");
  std::thread([&] {
    pthread_setname_np(pthread_self(), "left_hand");
    work();
  }).join();
}

TEST(LastWords, AnExceptionThatNobodyCatchesIsNamedWithItsThreadAndItsCalls) {
  EXPECT_EXIT(dies_in_its_thread([] { throw std::out_of_range("beat 5 of 4"); }),
              testing::KilledBySignal(SIGABRT),
              "drummer: uncaught exception in thread 'left_hand': std::out_of_range: beat 5 of 4\n"
              "drummer: SIGABRT in thread 'left_hand', called from:\n.*\\(.*\\[0x");
}

TEST(LastWords, WhatIsThrownNeedBeNoException) {
  EXPECT_EXIT(dies_in_its_thread([] { throw 5; }), testing::KilledBySignal(SIGABRT),
              "drummer: uncaught exception in thread 'left_hand': int\n");
}

TEST(LastWords, AThreadThatRunsAndIsForgottenIsTold) {
  EXPECT_EXIT(dies_in_its_thread([] { std::thread forgotten(pause); }), testing::KilledBySignal(SIGABRT),
              "left_hand': none: a thread was destroyed while it ran");
}

TEST(LastWords, ALibraryThatAbortsIsToldWithItsCalls) {
  EXPECT_EXIT(dies_in_its_thread([] { std::abort(); }), testing::KilledBySignal(SIGABRT),
              "^drummer: SIGABRT in thread 'left_hand', called from:\n.*libc.*abort");
}

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
TEST(LastWords, AWrongAddressIsToldWithItsCalls) {
  EXPECT_EXIT(dies_in_its_thread([] { raise(SIGSEGV); }), testing::KilledBySignal(SIGSEGV),
              "^drummer: SIGSEGV in thread 'left_hand', called from:\n.*\\[0x");
}
#endif

TEST(LastWords, WhoCannotTellEndsNevertheless) {
  const auto unread = [] {
    int ends[2] = {-1, -1};
    ASSERT_EQ(pipe(ends), 0);
    fcntl(ends[1], F_SETFL, O_NONBLOCK);
    const char filler[4096] = {};
    while (write(ends[1], filler, sizeof filler) > 0) {
    }
    fcntl(ends[1], F_SETFL, 0);
    dup2(ends[1], STDERR_FILENO);
    dies_in_its_thread([] { std::abort(); });
  };
  EXPECT_EXIT(unread(), testing::KilledBySignal(SIGALRM), "");
}

}  // namespace
}  // namespace phantom::runtime
