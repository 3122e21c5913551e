#include "common/dds/admission/source_guard.hpp"

#include <gtest/gtest.h>

namespace phantom::dds {
namespace {

using Verdict = SourceGuard::Verdict;
constexpr core::Nanoseconds kMs = core::kNsPerMillisecond;

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

TEST(SourceGuard, OneProcessIsFollowedAndASecondBesideItIsReported) {
  SourceGuard source;
  EXPECT_EQ(source.assess(stamp(1, 1), 1000 * kMs), Verdict::kAccepted);
  EXPECT_EQ(source.assess(stamp(1, 1), 1001 * kMs), Verdict::kOutOfOrder) << "it came twice";
  EXPECT_EQ(source.assess(stamp(2, 7), 1002 * kMs), Verdict::kRival);
  EXPECT_FALSE(source.has_second(1003 * kMs)) << "it may be a successor";
  EXPECT_EQ(source.assess(stamp(1, 4), 1004 * kMs), Verdict::kAccepted);
  EXPECT_TRUE(source.has_second(1005 * kMs)) << "the first is there, too";
  const SourceGuard copy = source;
  EXPECT_TRUE(copy.has_second(1005 * kMs)) << "a copy goes on by itself";
  EXPECT_FALSE(source.has_second(1004 * kMs + SourceGuard::kRivalMemory_ns));
  EXPECT_EQ(source.lost(), 2U);
}

TEST(SourceGuard, ASuccessorIsFollowedAndNotReportedAsASecond) {
  SourceGuard source;
  EXPECT_EQ(source.assess(stamp(1, 1), 1000 * kMs), Verdict::kAccepted);
  EXPECT_EQ(source.assess(stamp(2, 1), 1200 * kMs), Verdict::kRival);
  const core::Nanoseconds after = 1000 * kMs + SourceGuard::kHold_ns;
  EXPECT_EQ(source.assess(stamp(2, 2), after), Verdict::kAccepted);
  EXPECT_EQ(source.assess(stamp(2, 3), after + kMs), Verdict::kAccepted);
  EXPECT_FALSE(source.has_second(after + 2 * kMs));
}

TEST(SourceGuard, AnotherIsARivalOnlyWhileTheFollowedOneIsThere) {
  SourceGuard followed;
  EXPECT_FALSE(followed.is_rival(stamp(2, 1), 1000 * kMs)) << "nobody is followed yet";
  followed.assess(stamp(1, 1), 1000 * kMs);
  EXPECT_FALSE(followed.is_rival(stamp(1, 2), 1001 * kMs));
  EXPECT_TRUE(followed.is_rival(stamp(2, 1), 1000 * kMs + SourceGuard::kHold_ns - 1));
  EXPECT_FALSE(followed.is_rival(stamp(2, 1), 1000 * kMs + SourceGuard::kHold_ns));
}

TEST(SourceGuard, EventsAreTakenFromTheProcessThatIsFollowedOnAPeriodicTopic) {
  SourceGuard periodic, events;
  periodic.assess(stamp(1, 1), 1000 * kMs);
  EXPECT_EQ(events.assess_event(stamp(2, 1), 1001 * kMs, periodic), Verdict::kRival);
  EXPECT_EQ(events.rival_session(), 2U);
  EXPECT_EQ(events.assess_event(stamp(1, 5), 1002 * kMs, periodic), Verdict::kAccepted);
  EXPECT_EQ(events.assess_event(stamp(1, 5), 1003 * kMs, periodic), Verdict::kOutOfOrder);
  EXPECT_EQ(events.assess_event(stamp(2, 2), 1000 * kMs + SourceGuard::kHold_ns, periodic),
            Verdict::kAccepted)
      << "the followed one has gone";
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
