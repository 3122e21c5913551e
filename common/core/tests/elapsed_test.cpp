#include "common/core/elapsed.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace phantom::core {
namespace {

constexpr Nanoseconds kMin = std::numeric_limits<Nanoseconds>::min();
constexpr Nanoseconds kMax = std::numeric_limits<Nanoseconds>::max();

TEST(ElapsedNs, IsTheDifferenceWhereItFitsAndElseTheNearestThatDoes) {
  EXPECT_EQ(elapsed_ns(3, 10), 7);
  EXPECT_EQ(elapsed_ns(10, 3), -7);
  EXPECT_EQ(elapsed_ns(kMin, -1), kMax);
  EXPECT_EQ(elapsed_ns(kMin, 0), kMax);
  EXPECT_EQ(elapsed_ns(kMin, kMax), kMax);
  EXPECT_EQ(elapsed_ns(kMax, -1), kMin);
  EXPECT_EQ(elapsed_ns(kMax, -2), kMin);
  EXPECT_EQ(elapsed_ns(kMax, kMin), kMin);
  EXPECT_EQ(elapsed_ns(kMin, kMin), 0);
}

}  // namespace
}  // namespace phantom::core
