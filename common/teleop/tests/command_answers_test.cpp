#include "common/teleop/commands/command_answers.hpp"

#include <gtest/gtest.h>

namespace phantom::teleop {
namespace {

using State = SideAnswer::State;

constexpr core::Nanoseconds kAsked_ns = 50 * core::kNsPerSecond;
constexpr core::Nanoseconds kAfter_ns = kAsked_ns + CommandAnswers::kUnderWay_ns;

TEST(CommandAnswers, AStopIsDoneOnceBothSidesHaveSaidSo) {
  CommandAnswers stop(true, true, kAsked_ns);
  EXPECT_FALSE(stop.done());
  EXPECT_EQ(stop_words(stop), "NOT CONFIRMED by master_io, slave_io");
  stop.take_reply(Side::kMaster, true, "stopped");
  EXPECT_FALSE(stop.done());
  EXPECT_EQ(stop_words(stop), "NOT CONFIRMED by slave_io; stopped: master_io");
  stop.take_reply(Side::kSlave, true, "stopped");
  EXPECT_TRUE(stop.done());
  EXPECT_EQ(stop_words(stop), "stopped: master_io, slave_io");
}

TEST(CommandAnswers, ASideThatHasNotConfirmedIsOverdueAfterThreeTenthsOfASecond) {
  CommandAnswers stop(true, true, kAsked_ns);
  stop.take_reply(Side::kMaster, true, "");
  EXPECT_FALSE(stop.overdue(Side::kSlave, kAsked_ns + CommandAnswers::kOverdue_ns));
  EXPECT_TRUE(stop.overdue(Side::kSlave, kAsked_ns + CommandAnswers::kOverdue_ns + 1));
  EXPECT_FALSE(stop.overdue(Side::kMaster, kAsked_ns + core::kNsPerSecond));
}

// An operator who presses again and again must not put off the alarm.
TEST(CommandAnswers, AskingAgainDoesNotPutOffTheAlarm) {
  CommandAnswers first(true, true, kAsked_ns);
  first.take_reply(Side::kMaster, true, "");
  CommandAnswers again(true, true, kAsked_ns + 200 * core::kNsPerMillisecond);
  again.keep_waiting_since(first);
  const core::Nanoseconds now_ns = kAsked_ns + CommandAnswers::kOverdue_ns + 1;
  EXPECT_TRUE(again.overdue(Side::kSlave, now_ns));
  EXPECT_FALSE(again.overdue(Side::kMaster, now_ns)) << "it had confirmed the first";
}

// A sample that says STOPPED may have been sent before the stop was asked for, and a reset may have come
// between.
TEST(CommandAnswers, AStateConfirmsAStopOnlyIfItCannotHaveBeenUnderWayBefore) {
  CommandAnswers stop(true, true, kAsked_ns);
  stop.take_stopped(Side::kSlave, kAsked_ns - 1);
  stop.take_stopped(Side::kSlave, kAfter_ns - 1);
  EXPECT_EQ(stop.of(Side::kSlave).state, State::kWaiting);
  stop.take_stopped(Side::kSlave, kAfter_ns);
  EXPECT_EQ(stop.of(Side::kSlave).state, State::kDone);
}

TEST(CommandAnswers, ARefusedStopIsSaidAndStaysOverdueUntilItIsDone) {
  CommandAnswers stop(true, true, kAsked_ns);
  stop.take_reply(Side::kMaster, true, "");
  stop.take_reply(Side::kSlave, false, "the drives do not answer");
  EXPECT_TRUE(stop.answered());
  EXPECT_TRUE(stop.refused());
  EXPECT_FALSE(stop.done());
  EXPECT_TRUE(stop.overdue(Side::kSlave, kAsked_ns + core::kNsPerSecond));
  EXPECT_EQ(stop_words(stop), "slave_io REFUSED the stop: the drives do not answer; stopped: master_io");
  stop.take_reply(Side::kSlave, true, "stopped");
  EXPECT_TRUE(stop.done());
  stop.take_reply(Side::kSlave, false, "late");
  EXPECT_TRUE(stop.done()) << "what is done stays done";
}

TEST(CommandAnswers, WhatIsForTheMasterAloneDoesNotWaitForTheSlave) {
  CommandAnswers gain(true, false, kAsked_ns);
  gain.take_reply(Side::kSlave, true, "not asked");
  EXPECT_FALSE(gain.answered());
  EXPECT_EQ(command_words(gain), "no answer from master_io");
  gain.take_reply(Side::kMaster, false, "1/A 10 is not stable; allowed up to 1.7");
  EXPECT_TRUE(gain.answered());
  EXPECT_FALSE(gain.done());
  EXPECT_EQ(command_words(gain), "master_io: 1/A 10 is not stable; allowed up to 1.7");
}

TEST(CommandAnswers, WhatNobodyAnswersIsSent) {
  const CommandAnswers mark(false, false, kAsked_ns);
  EXPECT_TRUE(mark.done());
  EXPECT_EQ(command_words(mark), "sent");
}

}  // namespace
}  // namespace phantom::teleop
