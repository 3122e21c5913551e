#include "common/messages/request_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/captured_log.hpp"

namespace phantom::messages {
namespace {

TEST(RequestLog, SR26_WhatWasLeftOutIsToldWithTheNextThatIsLogged) {
  const test::CapturedLog log;
  core::LogRate rate;
  int logged = 0;
  const auto admit = [&](core::Nanoseconds at_ns) { logged += rate.admit(at_ns).log ? 1 : 0; };
  // A flood long ago, so that the next request falls into a new period.
  const core::Nanoseconds now_ns = core::monotonic_ns();
  for (int i = 0; i < 40; ++i) admit(now_ns - 2 * core::LogRate::kPeriod_ns);
  ASSERT_EQ(logged, core::LogRate::kBurst);
  EXPECT_TRUE(is_logged(rate, "requests"));
  EXPECT_TRUE(is_logged(rate, "requests"));
  EXPECT_EQ(log.text(), "warning: requests: 30 more, not logged\n");
}

}  // namespace
}  // namespace phantom::messages
