#include "common/core/status.hpp"

#include <gtest/gtest.h>

namespace phantom::core {
namespace {

Expected<int> half(int value) {
  if (value % 2 != 0)
    return Status::invalid_argument("value: " + std::to_string(value) + " is odd; allowed: even");
  return value / 2;
}

TEST(Expected, CarriesTheValueOrTheReason) {
  ASSERT_TRUE(half(8));
  EXPECT_EQ(*half(8), 4);
  const auto odd = half(7);
  ASSERT_FALSE(odd);
  EXPECT_EQ(odd.status().code(), ErrorCode::kInvalidArgument);
  EXPECT_EQ(odd.status().message(), "value: 7 is odd; allowed: even");
}

TEST(Status, IsOkByDefault) {
  EXPECT_TRUE(Status::ok());
  EXPECT_FALSE(Status::not_found("no such file"));
}

}  // namespace
}  // namespace phantom::core
