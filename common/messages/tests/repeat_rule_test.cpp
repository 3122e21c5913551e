#include "common/messages/repeat_rule.hpp"

#include <gtest/gtest.h>

namespace phantom::messages {
namespace {

using namespace std::chrono_literals;

class Repeats : public ::testing::Test {
 protected:
  RepeatRule rule_;
  RepeatRule::Time now_{1h};

  bool after(std::chrono::milliseconds wait, std::uint32_t ends) {
    now_ += wait;
    return rule_.due(now_, ends);
  }
};

TEST_F(Repeats, NothingWhileNobodyMayAnswer) {
  EXPECT_FALSE(after(0ms, 0));
  EXPECT_FALSE(after(10s, 0));
  EXPECT_TRUE(after(0ms, 1));
}

TEST_F(Repeats, SoonUntilItIsRepliedTo) {
  EXPECT_TRUE(after(0ms, 1));
  EXPECT_FALSE(after(99ms, 1));
  EXPECT_TRUE(after(1ms, 1));
  EXPECT_FALSE(after(20ms, 1));
  EXPECT_TRUE(after(80ms, 1));
}

TEST_F(Repeats, SeldomOnceItWasRepliedTo) {
  EXPECT_TRUE(after(0ms, 1));
  rule_.heard(now_);
  EXPECT_FALSE(after(2999ms, 1));
  rule_.heard(now_);  // how far it is
  EXPECT_FALSE(after(2999ms, 1));
  EXPECT_TRUE(after(1ms, 1)) << "the last reply may have been lost";
  EXPECT_TRUE(after(100ms, 1)) << "and this one, too";
}

TEST_F(Repeats, AtOnceForWhoJoins) {
  EXPECT_TRUE(after(0ms, 1));
  rule_.heard(now_);
  EXPECT_TRUE(after(1ms, 2));
  EXPECT_FALSE(after(1ms, 1));  // one has left
  EXPECT_TRUE(after(1ms, 2));   // and is back, or started anew
}

}  // namespace
}  // namespace phantom::messages
