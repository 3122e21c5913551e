#include "common/core/log_rate.hpp"

#include <gtest/gtest.h>

namespace phantom::core {
namespace {

TEST(LogRate, SR26_AFloodIsLoggedAtARateAndCounted) {
  LogRate rate;
  int logged = 0;
  for (int i = 0; i < 1000; ++i) logged += rate.admit(1 + i).log ? 1 : 0;
  EXPECT_EQ(logged, LogRate::kBurst);
  const auto next = rate.admit(1 + LogRate::kPeriod_ns);
  EXPECT_TRUE(next.log);
  EXPECT_EQ(next.left_out, 1000U - LogRate::kBurst);
  EXPECT_EQ(rate.admit(2 + LogRate::kPeriod_ns).left_out, 0U) << "they are reported once";
}

TEST(LogRate, RareEventsAreAllLogged) {
  LogRate rate;
  for (int i = 1; i < 100; ++i) EXPECT_TRUE(rate.admit(i * kNsPerSecond).log);
}

}  // namespace
}  // namespace phantom::core
