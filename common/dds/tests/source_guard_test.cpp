#include "common/dds/source_guard.hpp"

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

TEST(SourceGuard, TwoWritersAreNeverFollowedInTurn) {
  SourceGuard guard;
  for (std::uint64_t n = 1; n <= 2000; ++n) {
    const auto now_ns = static_cast<core::Nanoseconds>(n) * kMs;
    ASSERT_EQ(guard.judge(stamp(1, n), now_ns), Verdict::kAccepted);
    ASSERT_EQ(guard.judge(stamp(2, 10 * n), now_ns), Verdict::kRival);
    ASSERT_EQ(guard.judge(stamp(1, n), now_ns), Verdict::kOutOfOrder) << "who came first goes on";
  }
  EXPECT_TRUE(guard.has_rival(2001 * kMs));
  EXPECT_FALSE(guard.has_rival(2000 * kMs + SourceGuard::kRivalMemory_ns)) << "it has ended";
}

TEST(SourceGuard, ASuccessorIsAcceptedOnceTheFirstHasFallenSilent) {
  SourceGuard guard;
  ASSERT_EQ(guard.judge(stamp(1, 100), 1000 * kMs), Verdict::kAccepted);
  EXPECT_EQ(guard.judge(stamp(2, 1), 1000 * kMs + SourceGuard::kHold_ns - 1), Verdict::kRival);
  EXPECT_EQ(guard.judge(stamp(2, 2), 1000 * kMs + SourceGuard::kHold_ns), Verdict::kAccepted);
  EXPECT_EQ(guard.judge(stamp(1, 101), 1001 * kMs + SourceGuard::kHold_ns), Verdict::kRival)
      << "it froze, and was replaced meanwhile";
}

TEST(SourceGuard, ARepeatedOldSampleKeepsNobodyBound) {
  SourceGuard guard(100 * kMs);
  ASSERT_EQ(guard.judge(stamp(1, 5), 1000 * kMs), Verdict::kAccepted);
  EXPECT_EQ(guard.judge(stamp(1, 5), 1090 * kMs), Verdict::kOutOfOrder);
  EXPECT_EQ(guard.judge(stamp(2, 1), 1110 * kMs), Verdict::kAccepted);
}

TEST(SourceGuard, AnUnnumberedSampleBindsNobody) {
  SourceGuard guard;
  EXPECT_EQ(guard.judge(stamp(1, 0), 1000 * kMs), Verdict::kOutOfOrder);
  EXPECT_EQ(guard.judge(stamp(2, 1), 1001 * kMs), Verdict::kAccepted);
}

TEST(SourceGuard, ASecondWriterIsToldWithoutHidingAFault) {
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
