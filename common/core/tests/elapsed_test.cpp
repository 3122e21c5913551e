#include "common/core/elapsed.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace phantom::core {
namespace {

constexpr Nanoseconds kLeast = std::numeric_limits<Nanoseconds>::min();
constexpr Nanoseconds kGreatest = std::numeric_limits<Nanoseconds>::max();

TEST(ElapsedNs, IsTheDifferenceWhereItFitsAndElseTheNearestThatDoes) {
  EXPECT_EQ(elapsed_ns(3, 10), 7);
  EXPECT_EQ(elapsed_ns(10, 3), -7);
  EXPECT_EQ(elapsed_ns(kLeast, -1), kGreatest);
  EXPECT_EQ(elapsed_ns(kLeast, 0), kGreatest);
  EXPECT_EQ(elapsed_ns(kLeast, kGreatest), kGreatest);
  EXPECT_EQ(elapsed_ns(kGreatest, -1), kLeast);
  EXPECT_EQ(elapsed_ns(kGreatest, -2), kLeast);
  EXPECT_EQ(elapsed_ns(kGreatest, kLeast), kLeast);
  EXPECT_EQ(elapsed_ns(kLeast, kLeast), 0);
}

}  // namespace
}  // namespace phantom::core
