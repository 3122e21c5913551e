#include "common/teleop/commands/stop_requests.hpp"

#include <gtest/gtest.h>

namespace phantom::teleop {
namespace {

TEST(StopRequests, EveryAcceptedResetHasItsResult) {
  StopRequests requests;
  std::uint32_t accepted = 0;
  StopRequests::Reset reset;
  for (int i = 0; i < 200; ++i) {  // the servo answers at once, but nobody takes the results
    if (requests.reset({}) == 0) continue;
    ++accepted;
    ASSERT_TRUE(requests.take(reset));
    requests.give_result({reset.number, true});
  }
  EXPECT_LT(accepted, 200U);
  StopRequests::Result result;
  for (std::uint32_t number = 1; number <= accepted; ++number) {
    ASSERT_TRUE(requests.take_result(result)) << number;
    EXPECT_EQ(result.number, number);
  }
  EXPECT_FALSE(requests.take_result(result));
  EXPECT_NE(requests.reset({}), 0U) << "there is room again";
}

TEST(StopRequests, ARefusedResetTakesNoNumber) {
  StopRequests requests;
  std::uint32_t last = 0;
  while (const std::uint32_t number = requests.reset({})) {
    EXPECT_EQ(number, last + 1);
    last = number;
  }
  StopRequests::Reset reset;
  ASSERT_TRUE(requests.take(reset));
  EXPECT_EQ(requests.reset({}), last + 1);
}

}  // namespace
}  // namespace phantom::teleop
