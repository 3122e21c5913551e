#include "common/wire/guard.hpp"

#include <gtest/gtest.h>

#include <map>
#include <numeric>
#include <random>
#include <string_view>
#include <utility>

#include "common/wire/tests/guard_fixture.hpp"

namespace phantom::wire {
namespace {

using test::fragment_submessage;
using test::GuardTest;
using test::kFar;
using test::kHost;
using test::kSecond;
using test::message;
using test::peer;

constexpr Source kOther{0x0a1e0102, 40001};

struct SmallGuard : GuardTest {
  SmallGuard()
      : GuardTest({.participants = 6,
                   .participants_per_source = 4,
                   .endpoints_per_participant = 3,
                   .sample_bytes = 1000,
                   .discovery_per_s = 10,
                   .discovery_burst = 40,
                   .unannounced_per_s = 10,
                   .unannounced_burst = 30}) {}
};

struct ForgettingBySilence : GuardTest {
  ForgettingBySilence() : GuardTest({.forgets_by_silence = true}) {}
};

struct JudgingLeases : GuardTest {
  JudgingLeases() : GuardTest({.receiver = {.unchecked_leases = true}}) {}
};

struct RelayedGuard : GuardTest {
  RelayedGuard() : GuardTest({.relayed = true}) {}
};

struct NamedNetworks : GuardTest {
  NamedNetworks() : GuardTest({.networks = {{0x0a1e0100, 0xffffff00}, {0x7f000000, 0xff000000}}}) {}
};

TEST(Fault, WordsFitTheNameOfAFigure) {
  for (std::size_t i = 0; i < kFaults; ++i)
    EXPECT_LE(std::string_view(words_of(static_cast<Fault>(i))).size(), 50u);
}

// Fast DDS would check any shorter lease by a timer of its own.
TEST_F(JudgingLeases, ShowsFastDdsALeaseThatDoesNotEnd) {
  for (const std::uint32_t seconds : {1u, 5u, kMaxLease_s + 1}) {
    EXPECT_EQ(receive(test::announcement(test::kPeer, seconds)), Fault::kNone);
    EXPECT_EQ(last, test::announcement(test::kPeer, kUncheckedLease_s));
    EXPECT_DOUBLE_EQ(facts->participants[0].lease_s, std::min(seconds, kMaxLease_s));
  }
}

TEST_F(JudgingLeases, TellsWhoWasNotHeardForTheAnnouncedLease) {
  receive(test::announcement(peer(1), 5));
  receive(test::announcement(peer(2), 9));
  EXPECT_TRUE(guard.take_lapsed(6 * kSecond).empty());
  EXPECT_EQ(guard.take_lapsed(6 * kSecond + 1), std::vector<GuidPrefix>{peer(1)});
  EXPECT_TRUE(guard.take_lapsed(7 * kSecond).empty()) << "each once";
  receive(test::announcement(peer(2), 9), kHost, 9 * kSecond);
  EXPECT_TRUE(guard.take_lapsed(18 * kSecond).empty()) << "it was heard meanwhile";
}

// A process that stood still finds in its sockets what was sent meanwhile, before it looks at leases.
TEST_F(JudgingLeases, TellsWhoSpeaksAgainAfterItsLease) {
  EXPECT_EQ(receive(test::announcement(peer(1), 5)), Fault::kNone);
  EXPECT_FALSE(guard.lapsed()) << "nothing was handed on before";
  receive(test::announcement(peer(1), 5), kHost, 6 * kSecond);
  EXPECT_FALSE(guard.lapsed());
  EXPECT_EQ(receive(test::announcement(peer(1), 5), kHost, 12 * kSecond), Fault::kNone);
  EXPECT_TRUE(guard.lapsed());
  EXPECT_EQ(receive(test::announcement(peer(1), 5), kHost, 13 * kSecond), Fault::kNone);
  EXPECT_FALSE(guard.lapsed());
}

TEST_F(SmallGuard, LeavesLeasesToFastDdsUnlessAskedToJudge) {
  EXPECT_EQ(receive(test::announcement(test::kPeer, 5)), Fault::kNone);
  EXPECT_EQ(last, test::announcement(test::kPeer, 5));
  EXPECT_TRUE(guard.take_lapsed(100 * kSecond).empty());
}

TEST_F(NamedNetworks, AdmitsTheirSendersOnly) {
  EXPECT_TRUE(guard.admits({0x0a1e0163, 1}));
  EXPECT_TRUE(guard.admits({0x7f000001, 1}));
  EXPECT_FALSE(guard.admits({0x0a1e0263, 1}));
}

TEST_F(SmallGuard, BoundsParticipantsOfOneAddress) {
  for (int i = 0; i < 4; ++i) EXPECT_EQ(receive(test::announcement(peer(i))), Fault::kNone);
  EXPECT_EQ(receive(test::announcement(peer(4))), Fault::kParticipants);
  EXPECT_EQ(receive(test::announcement(peer(0))), Fault::kNone) << "who is known stays";
  EXPECT_EQ(receive(test::announcement(peer(5)), kFar), Fault::kNone) << "another address has its own";
}

TEST_F(SmallGuard, BoundsParticipantsInAll) {
  for (int i = 0; i < 6; ++i)
    EXPECT_EQ(receive(test::announcement(peer(i)), {static_cast<std::uint32_t>(i), 1}), Fault::kNone);
  EXPECT_EQ(receive(test::announcement(peer(9)), {9, 1}), Fault::kParticipants);
}

TEST_F(SmallGuard, ForgetsWhoseLeaseHasEnded) {
  for (int i = 0; i < 4; ++i) receive(test::announcement(peer(i), 5));
  EXPECT_EQ(receive(test::announcement(peer(7), 5), kHost, 6 * kSecond), Fault::kParticipants)
      << "the lease runs";
  EXPECT_EQ(receive(test::announcement(peer(7), 5), kHost, 20 * kSecond), Fault::kNone);
}

TEST_F(SmallGuard, GivesThePlaceOfAnEndlessLeaseBackAfter151Seconds) {
  for (int i = 0; i < 4; ++i) receive(test::announcement(peer(i), 0x7fffffff));
  EXPECT_EQ(receive(test::announcement(peer(7)), kHost, 151 * kSecond), Fault::kParticipants);
  EXPECT_EQ(receive(test::announcement(peer(7)), kHost, 153 * kSecond), Fault::kNone);
}

TEST_F(SmallGuard, BoundsEndpointsOfAParticipant) {
  receive(test::announcement(peer(1)));
  for (EntityId id = 1; id <= 3; ++id)
    EXPECT_EQ(receive(test::endpoint_announcement({peer(1), id << 8 | 3})), Fault::kNone);
  EXPECT_EQ(receive(test::endpoint_announcement({peer(1), 0x403})), Fault::kEndpoints);
  EXPECT_EQ(receive(test::endpoint_announcement({peer(1), 0x203})), Fault::kNone) << "it is known";
}

TEST_F(SmallGuard, BoundsStrangersDiscoveryInTime) {
  const auto nothing = test::header(peer(1));
  int passed = 0;
  for (int i = 0; i < 100; ++i) passed += receive(nothing) == Fault::kNone ? 1 : 0;
  EXPECT_EQ(passed, 40);
  EXPECT_EQ(receive(nothing, kHost, 2 * kSecond), Fault::kNone) << "ten a second come back";
}

TEST_F(SmallGuard, BoundsStrangersHandshakesInTime) {
  int passed = 0;
  for (int i = 0; i < 100; ++i) {
    const auto fault = receive(test::handshake(peer(i), 1 + i));  // each in another's name, from one address
    EXPECT_TRUE(facts->handshake);
    passed += fault == Fault::kNone ? 1 : 0;
  }
  EXPECT_EQ(passed, 40) << "they share the budget of discovery";
  EXPECT_EQ(receive(test::header(peer(1))), Fault::kRate);
  EXPECT_EQ(receive(test::handshake(peer(1), 200), kFar), Fault::kNone) << "another address has its own";
  EXPECT_EQ(receive(test::handshake(peer(1), 201), kHost, 2 * kSecond), Fault::kNone)
      << "ten a second come back";
}

/// A sample at a port of data.
std::vector<std::uint8_t> sample(const GuidPrefix& from) {
  return message({test::submessage(SubmessageId::kData, 4,
                                   test::data_fields(0x104, 0x103, 1, test::Octets(),
                                                     test::Octets().u8({0, 1, 0, 0}).u32(7)))},
                 from);
}

TEST_F(SmallGuard, BoundsSamplesOfWhoHasNotAnnouncedItself) {
  int passed = 0;
  for (int i = 0; i < 100; ++i)
    passed += receive(sample(peer(i)), kHost, kSecond, false) == Fault::kNone ? 1 : 0;
  EXPECT_EQ(passed, 30) << "whatever names it takes";
  EXPECT_EQ(receive(sample(peer(1)), kHost, kSecond, false), Fault::kUnannounced);
  EXPECT_EQ(receive(sample(peer(1)), kFar, kSecond, false), Fault::kNone) << "another address has its own";
  EXPECT_EQ(receive(sample(peer(1)), kHost, 2 * kSecond, false), Fault::kNone) << "ten a second come back";
  EXPECT_EQ(receive(test::announcement(peer(2)), kHost, kSecond), Fault::kNone)
      << "its discovery has another budget";
  for (int i = 0; i < 100; ++i)
    ASSERT_EQ(receive(sample(peer(2)), kHost, kSecond, false), Fault::kNone)
        << "who is known sends any number";
}

TEST_F(RelayedGuard, PassesSamplesOfWhoIsNotKnown) {
  for (int i = 0; i < 20'000; ++i)
    ASSERT_EQ(receive(sample(peer(1)), kHost, kSecond, false), Fault::kNone)
        << "a server may have said that it left, and it was only cut off";
}

TEST_F(SmallGuard, KeepsABudgetForWhoIsKnown) {
  receive(test::announcement(peer(1)), kOther);
  while (receive(test::header(peer(2)), kHost) == Fault::kNone) {
  }
  EXPECT_EQ(receive(test::announcement(peer(1)), kOther), Fault::kNone);
  EXPECT_EQ(receive(test::header(peer(1)), kHost), Fault::kRate) << "somebody else in its name";
}

TEST_F(GuardTest, RefusesAnnouncementsForAnother) {
  auto forged = test::announcement(peer(1));
  forged[19] ^= 1;  // the sender's own prefix
  EXPECT_EQ(receive(forged), Fault::kIdentity);
}

TEST_F(GuardTest, RefusesAnnouncementsFromASocketThatIsNotItsOwn) {
  receive(test::announcement(peer(1)), kHost, kSecond);
  EXPECT_EQ(receive(test::announcement(peer(1)), kOther, 2 * kSecond), Fault::kNone) << "it may have several";
  for (int second = 3; second < 10; ++second) receive(test::announcement(peer(1)), kHost, second * kSecond);
  EXPECT_EQ(receive(test::announcement(peer(1)), kFar, 10 * kSecond), Fault::kIdentity);
  EXPECT_EQ(receive(test::announcement(peer(1)), kFar, 14 * kSecond), Fault::kNone)
      << "none of its sockets was heard for a while: its network changed";
}

TEST_F(GuardTest, BelievesADepartureFromItsOwnSocket) {
  receive(test::announcement(peer(1)));
  EXPECT_EQ(receive(test::departure(peer(1)), kHost, 9 * kSecond), Fault::kNone);
  EXPECT_FALSE(guard.to_hold());
}

TEST_F(ForgettingBySilence, WhoLeftIsNotHeardUntilItsLeaseHasRunOut) {
  receive(test::announcement(peer(1), 5));
  ASSERT_EQ(receive(test::departure(peer(1)), kHost, 9 * kSecond), Fault::kNone)
      << "Fast DDS may heed it yet";
  EXPECT_EQ(receive(test::announcement(peer(1), 5), kHost, 10 * kSecond), Fault::kLeft);
  EXPECT_EQ(receive(test::header(peer(1)), kHost, 14 * kSecond), Fault::kLeft);
  EXPECT_EQ(
      receive(test::announcement(peer(1), 5), kHost, 9 * kSecond + 5 * kSecond + Guard::kForgetting + 1),
      Fault::kNone);
  EXPECT_EQ(receive(test::header(peer(1)), kHost, 15 * kSecond), Fault::kNone);
}

TEST_F(ForgettingBySilence, WhoWasLostAndReturnsIsNotHeardForALeaseFromItsFirstDatagram) {
  receive(test::announcement(peer(1), 5));
  guard.lost(peer(1));
  EXPECT_EQ(receive(test::announcement(peer(1), 5), kHost, 60 * kSecond), Fault::kLeft);
  EXPECT_TRUE(guard.returned());
  EXPECT_EQ(receive(test::announcement(peer(1), 5), kHost, 65 * kSecond), Fault::kLeft);
  EXPECT_FALSE(guard.returned()) << "only once";
  guard.lost(peer(1));  // as Fast DDS reports it, a lease after the last datagram that it was given
  EXPECT_EQ(receive(test::announcement(peer(1), 5), kHost, 66 * kSecond), Fault::kNone);
  EXPECT_FALSE(guard.returned());
}

TEST_F(ForgettingBySilence, NobodySilencesWhoSpeaks) {
  receive(test::announcement(peer(1), 5));
  ASSERT_EQ(receive(test::departure(peer(1)), kFar, 9 * kSecond), Fault::kNone);
  EXPECT_TRUE(guard.to_hold());
  EXPECT_EQ(receive(test::announcement(peer(1), 5), kHost, 10 * kSecond), Fault::kNone);
  EXPECT_EQ(guard.held(peer(1), 11 * kSecond), Verdict::kRefuse);
  EXPECT_EQ(receive(test::header(peer(1)), kHost, 12 * kSecond), Fault::kNone);
}

TEST_F(ForgettingBySilence, AHeldDepartureOfWhoIsSilentSilencesIt) {
  receive(test::announcement(peer(1), 5));
  receive(test::departure(peer(1)), kFar, 9 * kSecond);
  ASSERT_EQ(guard.held(peer(1), 9 * kSecond + Guard::kHold), Verdict::kPass);
  EXPECT_EQ(receive(test::announcement(peer(1), 5), kHost, 11 * kSecond), Fault::kLeft);
}

TEST_F(GuardTest, HoldsADepartureThatAnotherSends) {
  receive(test::announcement(peer(1)));
  ASSERT_EQ(receive(test::departure(peer(1)), kFar, 9 * kSecond), Fault::kNone);
  ASSERT_TRUE(guard.to_hold());
  EXPECT_EQ(guard.held(peer(1), 9 * kSecond + Guard::kHold / 2), Verdict::kHold);
  receive(test::header(peer(1)), kHost, 9 * kSecond + Guard::kHold / 2, false);
  EXPECT_EQ(guard.held(peer(1), 9 * kSecond + Guard::kHold / 2), Verdict::kRefuse) << "it goes on speaking";
}

TEST_F(GuardTest, ForgersCannotSpeakForTheOneTheySendAway) {
  receive(test::announcement(peer(1)));
  receive(test::departure(peer(1)), kFar, 9 * kSecond);
  receive(test::header(peer(1)), kFar, 9 * kSecond + 1, false);
  EXPECT_EQ(guard.held(peer(1), 9 * kSecond + 2), Verdict::kHold);
}

TEST_F(GuardTest, BelievesAHeldDepartureOfWhoIsSilent) {
  receive(test::announcement(peer(1)));
  receive(test::departure(peer(1)), kFar, 9 * kSecond);
  EXPECT_EQ(guard.held(peer(1), 9 * kSecond + Guard::kHold), Verdict::kPass);
}

TEST_F(GuardTest, PassesFragmentsOfWhoAnnouncedItself) {
  const auto one = message({fragment_submessage({})}, peer(1));
  EXPECT_EQ(receive(one), Fault::kStranger);
  receive(test::announcement(peer(1)));
  EXPECT_EQ(receive(one), Fault::kNone);
}

TEST_F(GuardTest, HoldsAWriterToItsFragmentSize) {
  receive(test::announcement(peer(1)));
  receive(message({fragment_submessage({})}, peer(1)));
  EXPECT_EQ(receive(message({fragment_submessage({.fragment_bytes = 60, .carried = 60})}, peer(1))),
            Fault::kFragmentSize);
  EXPECT_EQ(receive(message({fragment_submessage({.writer = 0x203, .fragment_bytes = 60, .carried = 60})},
                            peer(1))),
            Fault::kNone);
}

TEST_F(SmallGuard, BoundsSamples) {
  receive(test::announcement(peer(1)));
  EXPECT_EQ(receive(message({fragment_submessage({.sample_bytes = 1000})}, peer(1))), Fault::kNone);
  EXPECT_EQ(receive(message({fragment_submessage({.sample_bytes = 1001})}, peer(1))), Fault::kSampleSize);
}

// A server says once who is there, and says that one left who was only cut off.
TEST_F(RelayedGuard, HearsWhoWasSaidToHaveLeft) {
  ASSERT_EQ(receive(test::announcement(peer(1))), Fault::kNone);
  ASSERT_EQ(receive(test::departure(peer(1)), kFar), Fault::kNone);
  ASSERT_EQ(receive(test::heartbeat({peer(1), kUserWriter}, 2, 2)), Fault::kNone);
  EXPECT_EQ(last[kHeaderBytes], static_cast<int>(SubmessageId::kHeartbeat));
  EXPECT_EQ(receive(message({fragment_submessage({})}, peer(1))), Fault::kNone);
  EXPECT_EQ(receive(test::heartbeat({peer(1), kUserWriter}, 1L << 60, 1L << 60)), Fault::kCounting);
}

TEST_F(GuardTest, RefusesWhoSpeaksForAnother) {
  receive(test::announcement(peer(1)), kHost);
  receive(test::announcement(peer(2)), kOther);
  const auto as = [](const GuidPrefix& named) {
    const auto heartbeat = test::heartbeat({peer(1), kUserWriter}, 2, 2);
    auto whole = test::message(
        {test::submessage(SubmessageId::kInfoSource, 0, test::Octets().u32(0).u8({2, 3, 1, 15}).raw(named))},
        peer(2));
    whole.insert(whole.end(), heartbeat.begin() + kHeaderBytes, heartbeat.end());
    return whole;
  };
  EXPECT_EQ(receive(as(peer(2)), kOther), Fault::kNone);
  EXPECT_EQ(receive(as(peer(1)), kOther), Fault::kIdentity);
}

TEST_F(GuardTest, RefusesSamplesInTheNameOfAnother) {
  receive(test::announcement(peer(1)));
  receive(test::header(peer(1)), kHost, 9 * kSecond, false);
  EXPECT_EQ(receive(test::heartbeat({peer(1), kUserWriter}, 2, 2), kFar, 10 * kSecond, false),
            Fault::kIdentity);
  EXPECT_EQ(receive(test::heartbeat({peer(1), kUserWriter}, 2, 2), kHost, 10 * kSecond, false), Fault::kNone);
}

/// The announcement of `prefix` in fragments of 64 octets.
std::vector<std::vector<std::uint8_t>> in_fragments(const GuidPrefix& prefix, const test::Octets& payload) {
  std::vector<std::vector<std::uint8_t>> datagrams;
  const auto total = static_cast<std::uint32_t>(payload.bytes.size());
  for (std::uint32_t at = 0, number = 1; at < total; at += 64, ++number) {
    const auto part = std::span(payload.bytes).subspan(at, std::min(64u, total - at));
    datagrams.push_back(message({fragment_submessage({.reader = kParticipantReader,
                                                      .writer = kParticipantWriter,
                                                      .first = number,
                                                      .sample_bytes = total},
                                                     part)},
                                prefix));
  }
  return datagrams;
}

TEST_F(GuardTest, AssemblesDiscoveryThatComesInFragments) {
  const test::Octets payload = test::encapsulated(test::participant_list(peer(1)).sentinel());
  auto datagrams = in_fragments(peer(1), payload);
  std::swap(datagrams.front(), datagrams.back());  // in any order
  for (std::size_t i = 0; i < datagrams.size(); ++i) {
    ASSERT_EQ(receive(datagrams[i]), Fault::kNone);
    EXPECT_EQ(last[kHeaderBytes], static_cast<int>(SubmessageId::kPad)) << "Fast DDS does not see it";
    EXPECT_EQ(guard.assembled().size(), i + 1 == datagrams.size() ? 1u : 0u);
  }
  const auto whole = guard.assembled()[0];
  EXPECT_EQ(std::vector(whole.end() - static_cast<std::ptrdiff_t>(payload.bytes.size()), whole.end()),
            payload.bytes);
  EXPECT_EQ(receive(message({fragment_submessage({})}, peer(1))), Fault::kNone)
      << "it has announced itself by that";
}

// So they have discovery's budget and pass one at a time, whatever port they come in by.
TEST_F(GuardTest, FragmentsOfDiscoveryAreDiscovery) {
  receive(in_fragments(peer(1), test::encapsulated(test::participant_list(peer(1)).sentinel()))[0]);
  EXPECT_TRUE(facts->of_discovery());
  receive(message({fragment_submessage({})}, peer(1)));
  EXPECT_FALSE(facts->of_discovery());
  receive(test::handshake(peer(1)));
  EXPECT_TRUE(facts->of_discovery());
}

TEST_F(GuardTest, ChecksWhatItAssembled) {
  test::Octets broken = test::participant_list(peer(1));
  broken.parameter(Pid::kTopicName, test::Octets().u32(0xffff)).sentinel();
  Fault fault = Fault::kNone;
  for (const auto& datagram : in_fragments(peer(1), test::encapsulated(broken))) fault = receive(datagram);
  EXPECT_EQ(fault, Fault::kParameter);
  EXPECT_TRUE(guard.assembled().empty());
}

TEST_F(GuardTest, RefusesFragmentsThatContradictThoseBefore) {
  const auto part = [](std::uint32_t fragment, std::uint32_t sample) {
    return message({fragment_submessage({.reader = kParticipantReader,
                                         .writer = kParticipantWriter,
                                         .fragment_bytes = fragment,
                                         .sample_bytes = sample,
                                         .carried = fragment})},
                   peer(1));
  };
  EXPECT_EQ(receive(part(64, 256)), Fault::kNone);
  EXPECT_EQ(receive(part(64, 512)), Fault::kSampleSize);
  EXPECT_EQ(receive(part(32, 256)), Fault::kSampleSize);
  EXPECT_EQ(receive(part(64, 70000)), Fault::kSampleSize);
}

// Whatever order ten thousand of them come in, what is kept is bounded and what is whole is right.
TEST_F(GuardTest, KeepsFewUnfinishedSamples) {
  for (int i = 0; i < 10000; ++i) {
    const auto one = message({fragment_submessage({.reader = kParticipantReader,
                                                   .writer = kParticipantWriter,
                                                   .sequence = i + 1,
                                                   .sample_bytes = 60000})},
                             peer(i));
    EXPECT_EQ(receive(one, kHost, i * kSecond), Fault::kNone);
  }
  Fault fault = Fault::kNone;
  for (const auto& datagram :
       in_fragments(peer(1), test::encapsulated(test::participant_list(peer(1)).sentinel())))
    fault = receive(datagram, kHost, 20000 * kSecond);
  EXPECT_EQ(fault, Fault::kNone);
  EXPECT_EQ(guard.assembled().size(), 1u);
}

}  // namespace
}  // namespace phantom::wire
