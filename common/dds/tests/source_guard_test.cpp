#include "common/dds/admission/source_guard.hpp"

#include <gtest/gtest.h>

namespace phantom::dds {
namespace {

using Verdict = SourceGuard::Verdict;

msg::Stamp stamp(std::uint64_t session, std::uint64_t number) {
  msg::Stamp out;
  out.session(session);
  out.sequence_number(number);
  return out;
}

TEST(SourceGuard, SR11_TwoWritersAreNeverFollowedInTurn) {
  SourceGuard guard;
  for (std::uint64_t n = 1; n <= 2000; ++n) {
    const auto now_ns = static_cast<core::Nanoseconds>(n) * core::kNsPerMillisecond;
    ASSERT_EQ(guard.assess(stamp(1, n), now_ns), Verdict::kAccepted);
    ASSERT_EQ(guard.assess(stamp(2, 10 * n), now_ns), Verdict::kRival);
    ASSERT_EQ(guard.assess(stamp(1, n), now_ns), Verdict::kOutOfOrder) << "who came first goes on";
  }
  EXPECT_TRUE(guard.has_rival(2001 * core::kNsPerMillisecond));
  EXPECT_FALSE(guard.has_rival(2000 * core::kNsPerMillisecond + SourceGuard::kRivalMemory_ns))
      << "it has ended";
}

TEST(SourceGuard, ASuccessorIsAcceptedOnceTheFirstHasFallenSilent) {
  SourceGuard guard;
  ASSERT_EQ(guard.assess(stamp(1, 100), 1000 * core::kNsPerMillisecond), Verdict::kAccepted);
  EXPECT_EQ(guard.assess(stamp(2, 1), 1000 * core::kNsPerMillisecond + SourceGuard::kHold_ns - 1),
            Verdict::kRival);
  EXPECT_EQ(guard.assess(stamp(2, 2), 1000 * core::kNsPerMillisecond + SourceGuard::kHold_ns),
            Verdict::kAccepted);
  EXPECT_EQ(guard.assess(stamp(1, 101), 1001 * core::kNsPerMillisecond + SourceGuard::kHold_ns),
            Verdict::kRival)
      << "it froze, and was replaced meanwhile";
}

TEST(SourceGuard, ARepeatedOldSampleKeepsNobodyBound) {
  SourceGuard guard(100 * core::kNsPerMillisecond);
  ASSERT_EQ(guard.assess(stamp(1, 5), 1000 * core::kNsPerMillisecond), Verdict::kAccepted);
  EXPECT_EQ(guard.assess(stamp(1, 5), 1090 * core::kNsPerMillisecond), Verdict::kOutOfOrder);
  EXPECT_EQ(guard.assess(stamp(2, 1), 1110 * core::kNsPerMillisecond), Verdict::kAccepted);
}

TEST(SourceGuard, AnUnnumberedSampleBindsNobody) {
  SourceGuard guard;
  EXPECT_EQ(guard.assess(stamp(1, 0), 1000 * core::kNsPerMillisecond), Verdict::kOutOfOrder);
  EXPECT_EQ(guard.assess(stamp(2, 1), 1001 * core::kNsPerMillisecond), Verdict::kAccepted);
}

TEST(SourceGuard, AGreatNumberLocksNobodyOut) {
  for (const std::uint64_t session : {std::uint64_t{7}, UINT64_MAX}) {
    SourceGuard guard;
    ASSERT_EQ(guard.assess(stamp(session, 100), 1000 * core::kNsPerMillisecond), Verdict::kAccepted);
    EXPECT_EQ(guard.assess(stamp(session, UINT64_MAX), 1001 * core::kNsPerMillisecond), Verdict::kOutOfOrder);
    EXPECT_EQ(guard.assess(stamp(session, 101), 1002 * core::kNsPerMillisecond), Verdict::kAccepted)
        << "as if it had not come";
  }
}

TEST(SourceGuard, WhoeverBeganWithAGreatNumberIsHeardAgainAfterTheHold) {
  SourceGuard guard(100 * core::kNsPerMillisecond);
  ASSERT_EQ(guard.assess(stamp(1, UINT64_MAX), 1000 * core::kNsPerMillisecond), Verdict::kAccepted);
  EXPECT_EQ(guard.assess(stamp(1, 5), 1050 * core::kNsPerMillisecond), Verdict::kOutOfOrder);
  guard.heard(1, 1050 * core::kNsPerMillisecond);
  EXPECT_EQ(guard.assess(stamp(1, 3), 1100 * core::kNsPerMillisecond), Verdict::kAccepted)
      << "whatever its number";
  EXPECT_EQ(guard.assess(stamp(1, 4), 1101 * core::kNsPerMillisecond), Verdict::kAccepted);
}

TEST(SourceGuard, SaysWhoTheRivalIs) {
  SourceGuard guard;
  EXPECT_EQ(guard.rival_session(), 0u);
  ASSERT_EQ(guard.assess(stamp(1, 1), 1000 * core::kNsPerMillisecond), Verdict::kAccepted);
  for (std::uint64_t n = 1; n <= 3; ++n) guard.assess(stamp(2, n), 1001 * core::kNsPerMillisecond);
  EXPECT_EQ(guard.session(), 1u);
  EXPECT_EQ(guard.rival_session(), 2u);
  EXPECT_EQ(guard.rival_samples(), 3u);
}

TEST(SourceGuard, ATopicWrittenOnceKeepsToItsSourceWhileThatIsHeardElsewhere) {
  SourceGuard guard(2000 * core::kNsPerMillisecond);
  ASSERT_EQ(guard.assess(stamp(1, 1), 1000 * core::kNsPerMillisecond), Verdict::kAccepted);
  for (core::Nanoseconds at = 1500; at <= 60000; at += 500) {
    guard.heard(1, at * core::kNsPerMillisecond);
    guard.heard(3, at * core::kNsPerMillisecond);
  }
  EXPECT_EQ(guard.assess(stamp(2, 1), 60500 * core::kNsPerMillisecond), Verdict::kRival);
  EXPECT_EQ(guard.assess(stamp(1, 2), 60600 * core::kNsPerMillisecond), Verdict::kAccepted);
  guard.heard(2, 61000 * core::kNsPerMillisecond);
  EXPECT_EQ(guard.assess(stamp(2, 2), 62600 * core::kNsPerMillisecond), Verdict::kAccepted)
      << "the first has fallen silent";
}

TEST(SourceGuard, HearingOfSomebodyBindsNobody) {
  SourceGuard guard;
  guard.heard(0, 1000 * core::kNsPerMillisecond);
  EXPECT_EQ(guard.assess(stamp(2, 1), 1001 * core::kNsPerMillisecond), Verdict::kAccepted);
}

TEST(SourceGuard, ARivalOfASlowTopicIsRememberedAsLongAsItsSource) {
  SourceGuard guard(10000 * core::kNsPerMillisecond);
  ASSERT_EQ(guard.assess(stamp(1, 1), 1000 * core::kNsPerMillisecond), Verdict::kAccepted);
  ASSERT_EQ(guard.assess(stamp(2, 1), 2000 * core::kNsPerMillisecond), Verdict::kRival);
  EXPECT_TRUE(guard.has_rival(11999 * core::kNsPerMillisecond));
  EXPECT_FALSE(guard.has_rival(12000 * core::kNsPerMillisecond));
}

TEST(SourceGuard, SR15_ASecondWriterIsToldWithoutHidingAFault) {
  const core::Health running = with_rival({core::ComponentState::kRunning, "", {}, {}}, "slave_state");
  EXPECT_EQ(running.state, core::ComponentState::kDegraded);
  EXPECT_EQ(running.message, "two processes send slave_state: only the first is heeded; end one of them");
  const core::Health fault =
      with_rival({core::ComponentState::kFault, "j1 is in fault", {}, {}}, "slave_state");
  EXPECT_EQ(fault.state, core::ComponentState::kFault);
  EXPECT_NE(fault.message.find("j1 is in fault"), std::string::npos);
}

}  // namespace
}  // namespace phantom::dds
