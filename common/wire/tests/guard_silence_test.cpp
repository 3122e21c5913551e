// The guard watches who is silent, in place of Fast DDS.
#include <gtest/gtest.h>

#include "common/wire/tests/guard_fixture.hpp"

namespace phantom::wire {
namespace {

using test::announcement;
using test::GuardTest;
using test::kFar;
using test::kHost;
using test::kSecond;
using test::peer;

constexpr std::uint32_t kLease_s = 5;

struct WatchingGuard : GuardTest {
  WatchingGuard() : GuardTest({.receiver = {.watches_silence = true}}) {}

  Fault speak(core::Nanoseconds at, const Source& source = kHost) {
    return receive(test::header(peer(1)), source, at);
  }
};

TEST_F(WatchingGuard, FastDdsIsToldALeaseThatNeverEnds) {
  EXPECT_EQ(receive(announcement(peer(1), kLease_s)), Fault::kNone);
  EXPECT_EQ(last, announcement(peer(1), kLease_s + kLeaseLonger_s));
  EXPECT_DOUBLE_EQ(facts->participants[0].lease_s, kLease_s);
  EXPECT_EQ(receive(announcement(peer(2), 0x7fffffff)), Fault::kNone);
  EXPECT_EQ(last, announcement(peer(2), kLongestLease_s + kLeaseLonger_s));
}

TEST_F(WatchingGuard, ALeaseOfEitherByteOrderIsLengthened) {
  for (const bool little : {true, false}) {
    const auto list = [&](std::uint32_t seconds) {
      return test::Octets(little)
          .parameter(Pid::kParticipantGuid, test::Octets(little).guid({peer(1), kParticipantEntity}))
          .parameter(Pid::kLeaseDuration, test::Octets(little).u32(seconds).u32(1u << 31))
          .sentinel();
    };
    test::Octets given = list(kLease_s);
    ListFacts list_facts;
    std::size_t length = 0;
    ASSERT_EQ(
        check_parameter_list(given.bytes, little, ListPlace::kDiscovery, kVendorFastDds, list_facts, length),
        Fault::kNone);
    EXPECT_DOUBLE_EQ(list_facts.lease_s, kLease_s + 0.5);
    lengthen_lease(list_facts, little);
    EXPECT_EQ(given.bytes, list(kLease_s + kLeaseLonger_s).bytes);
  }
}

TEST_F(WatchingGuard, NothingIsLengthenedWhereFastDdsWatches) {
  GuardTest::options = {};
  EXPECT_EQ(receive(announcement(peer(1), kLease_s)), Fault::kNone);
  EXPECT_EQ(last, announcement(peer(1), kLease_s));
}

TEST_F(WatchingGuard, WhoIsSilentForItsLeaseIsNotHeardUntilItIsForgotten) {
  receive(announcement(peer(1), kLease_s), kHost, kSecond);
  EXPECT_EQ(guard.silence_of(peer(1), 6 * kSecond), Silence::kSpeaks);
  EXPECT_EQ(guard.silence_of(peer(1), 6 * kSecond + 1), Silence::kSilent);
  EXPECT_EQ(speak(4 * kSecond), Fault::kNone);
  EXPECT_EQ(guard.silence_of(peer(1), 9 * kSecond), Silence::kSpeaks) << "whatever it says";
  EXPECT_EQ(speak(10 * kSecond), Fault::kLeft);
  EXPECT_EQ(receive(announcement(peer(1), kLease_s), kHost, 10 * kSecond), Fault::kLeft);
  EXPECT_EQ(guard.silence_of(peer(1), 10 * kSecond), Silence::kSilent) << "what is refused is not heard";
  guard.forget(peer(1));
  EXPECT_EQ(guard.silence_of(peer(1), 10 * kSecond), Silence::kUnknown);
  EXPECT_EQ(receive(announcement(peer(1), kLease_s), kHost, 10 * kSecond), Fault::kNone);
  EXPECT_EQ(guard.silence_of(peer(1), 15 * kSecond), Silence::kSpeaks);
}

TEST_F(WatchingGuard, NobodyElseSpeaksForIt) {
  receive(announcement(peer(1), kLease_s), kHost, kSecond);
  EXPECT_EQ(speak(4 * kSecond - 1), Fault::kNone);
  EXPECT_EQ(speak(6 * kSecond, kFar), Fault::kIdentity);
  EXPECT_EQ(guard.silence_of(peer(1), 9 * kSecond), Silence::kSilent);
}

TEST_F(WatchingGuard, WhoLeavesIsUnknownAtOnce) {
  receive(announcement(peer(1), kLease_s));
  EXPECT_EQ(receive(test::departure(peer(1))), Fault::kNone);
  EXPECT_EQ(guard.silence_of(peer(1), kSecond), Silence::kUnknown);
}

}  // namespace
}  // namespace phantom::wire
