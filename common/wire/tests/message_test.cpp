#include "common/wire/message.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "common/wire/tests/messages.hpp"

namespace phantom::wire {
namespace {

using test::data_fields;
using test::fragment_submessage;
using test::kPeer;
using test::message;
using test::Octets;
using test::submessage;

struct MessageTest : ::testing::Test {
  Fault check(std::vector<std::uint8_t> datagram, bool secured = false) {
    last = std::move(datagram);
    return check_message(last, {secured}, *facts);
  }
  Fault of(SubmessageId id, int flags, const Octets& fields) {
    return check(message({submessage(id, flags, fields)}));
  }

  std::vector<std::uint8_t> last;
  std::unique_ptr<MessageFacts> facts = std::make_unique<MessageFacts>();
};

Octets acknack(std::int64_t base, std::uint32_t bits, std::size_t words) {
  Octets fields = Octets().entity(0x3c7).entity(0x3c2).sequence(base).u32(bits);
  for (std::size_t i = 0; i < words; ++i) fields.u32(0xffffffff);
  return fields.u32(1);
}
Octets heartbeat(std::int64_t first, std::int64_t last) {
  return Octets().entity(0).entity(0x103).sequence(first).sequence(last).u32(1);
}
Octets gap(std::int64_t start, std::int64_t base) {
  return Octets().entity(0).entity(0x103).sequence(start).sequence(base).u32(0);
}

TEST_F(MessageTest, NeedsAHeaderOfRtps2) {
  EXPECT_EQ(check(test::header()), Fault::kNone);
  for (std::size_t size = 0; size < kHeaderBytes; ++size) {
    std::vector<std::uint8_t> cut = test::header();
    cut.resize(size);
    EXPECT_EQ(check(cut), Fault::kHeader) << size;
  }
  for (const std::size_t at : {0, 1, 2, 3, 4}) {
    std::vector<std::uint8_t> wrong = test::header();
    wrong[at] ^= 1;
    EXPECT_EQ(check(wrong), Fault::kHeader) << at;
  }
}

TEST_F(MessageTest, ReadsAnnouncements) {
  ASSERT_EQ(check(test::announcement(test::peer(5), 12)), Fault::kNone);
  ASSERT_EQ(facts->participant_count, 1u);
  EXPECT_EQ(facts->participants[0].announced, test::peer(5));
  EXPECT_EQ(facts->participants[0].sender, test::peer(5));
  EXPECT_DOUBLE_EQ(facts->participants[0].lease_s, 12.0);
  EXPECT_FALSE(facts->participants[0].departs);
}

TEST_F(MessageTest, ReadsDepartures) {
  ASSERT_EQ(check(test::departure(test::peer(5))), Fault::kNone);
  ASSERT_EQ(facts->participant_count, 1u);
  EXPECT_TRUE(facts->participants[0].departs);
  EXPECT_EQ(facts->participants[0].announced, test::peer(5));
}

TEST_F(MessageTest, ReadsEndpoints) {
  ASSERT_EQ(check(test::endpoint_announcement({test::peer(5), 0x703})), Fault::kNone);
  ASSERT_EQ(facts->endpoint_count, 1u);
  EXPECT_EQ(facts->endpoints[0].endpoint, (Guid{test::peer(5), 0x703}));
}

// Fast DDS frees memory that it does not own when inline QoS is sound and the payload is not.
TEST_F(MessageTest, RefusesEveryCutOfDiscovery) {
  for (const auto& whole :
       {test::announcement(), test::departure(), test::endpoint_announcement({test::kPeer, 3})}) {
    for (std::size_t size = kHeaderBytes + 1; size < whole.size(); ++size) {
      std::vector<std::uint8_t> cut = whole;
      cut.resize(size);
      EXPECT_NE(check(cut), Fault::kNone) << size;
      if (size < kHeaderBytes + 4) continue;
      const std::size_t length = size - kHeaderBytes - 4;  // the same with a submessage that ends there
      cut[22] = static_cast<std::uint8_t>(length);
      cut[23] = static_cast<std::uint8_t>(length >> 8);
      EXPECT_NE(check(cut), Fault::kNone) << size;
    }
  }
}

TEST_F(MessageTest, HoldsSubmessagesAgainstTheDatagram) {
  const auto pad = submessage(SubmessageId::kPad, 0, Octets().u32(0));
  EXPECT_EQ(check(message({pad, pad})), Fault::kNone);
  auto longer = message({pad, pad});
  longer[22] = 16;
  EXPECT_EQ(check(longer), Fault::kSubmessage);
  auto unaligned = message({pad, pad});
  unaligned[22] = 3;
  EXPECT_EQ(check(unaligned), Fault::kSubmessage);
}

TEST_F(MessageTest, TakesLengthZeroAsUpToTheEnd) {
  auto last_one = message({submessage(SubmessageId::kHeartbeat, 0, heartbeat(1, 5))});
  last_one[22] = 0;
  EXPECT_EQ(check(last_one), Fault::kNone);
  last_one.resize(last_one.size() - 4);
  EXPECT_EQ(check(last_one), Fault::kSubmessage);
}

TEST_F(MessageTest, PassesUnknownKindsThatFit) {
  EXPECT_EQ(of(static_cast<SubmessageId>(0x80), 0, Octets().u32(1)), Fault::kNone);
  EXPECT_EQ(of(static_cast<SubmessageId>(0x7e), 0, Octets().u32(1)), Fault::kNone);
}

TEST_F(MessageTest, ChecksAcknowledgements) {
  EXPECT_EQ(of(SubmessageId::kAckNack, 0, acknack(1, 0, 0)), Fault::kNone);
  EXPECT_EQ(of(SubmessageId::kAckNack, 0, acknack(0, 0, 0)), Fault::kNone) << "before a writer is known";
  EXPECT_EQ(of(SubmessageId::kAckNack, 0, acknack(7, 256, 8)), Fault::kNone);
  EXPECT_EQ(of(SubmessageId::kAckNack, 0, acknack(7, 257, 9)), Fault::kNumberSet);
  EXPECT_EQ(of(SubmessageId::kAckNack, 0, acknack(0, 1, 1)), Fault::kNumberSet);
  EXPECT_EQ(of(SubmessageId::kAckNack, 0, acknack(-1, 0, 0)), Fault::kNumberSet);
  EXPECT_EQ(of(SubmessageId::kAckNack, 0, acknack(1, 64, 1)), Fault::kSubmessage) << "the count is missing";
  EXPECT_EQ(of(SubmessageId::kAckNack, 0, acknack(1, 96, 1)), Fault::kNumberSet);
}

TEST_F(MessageTest, ChecksHeartbeats) {
  EXPECT_EQ(of(SubmessageId::kHeartbeat, 0, heartbeat(1, 0)), Fault::kNone) << "nothing written yet";
  EXPECT_EQ(of(SubmessageId::kHeartbeat, 0, heartbeat(3, 9)), Fault::kNone);
  EXPECT_EQ(of(SubmessageId::kHeartbeat, 0, heartbeat(0, 9)), Fault::kSequence);
  EXPECT_EQ(of(SubmessageId::kHeartbeat, 0, heartbeat(5, 3)), Fault::kSequence);
  EXPECT_EQ(of(SubmessageId::kHeartbeat, 0, Octets().u32(0)), Fault::kSubmessage);
}

// By these it is known what of somebody's endpoints does not arrive (dds::DiscoveryGaps).
TEST_F(MessageTest, TellsTheNumbersOfThoseWhoAnnounceEndpoints) {
  const auto numbers = [&](SubmessageId id, EntityId writer, const Octets& rest) {
    EXPECT_EQ(of(id, 0, Octets().entity(0).entity(writer).raw(rest.bytes)), Fault::kNone);
    if (facts->discovery_count == 0) return std::vector<std::int64_t>();
    const DiscoverySequence& told = facts->discovery[0];
    EXPECT_EQ(told.writer, (Guid{kPeer, writer}));
    return std::vector<std::int64_t>{told.first, told.last, told.announced ? 1 : 0};
  };
  using Numbers = std::vector<std::int64_t>;
  for (const EntityId writer : {kPublicationWriter, kSubscriptionWriter}) {
    EXPECT_EQ(numbers(SubmessageId::kHeartbeat, writer, Octets().sequence(3).sequence(9).u32(1)),
              (Numbers{3, 9, 1}));
    EXPECT_EQ(numbers(SubmessageId::kGap, writer, Octets().sequence(2).sequence(6).u32(0)),
              (Numbers{2, 5, 0}));
  }
  EXPECT_EQ(numbers(SubmessageId::kHeartbeat, 0x103, Octets().sequence(3).sequence(9).u32(1)), Numbers());
  ASSERT_EQ(of(SubmessageId::kData, 0, data_fields(kPublicationReader, kPublicationWriter, 7, {}, {})),
            Fault::kNone);
  ASSERT_EQ(facts->discovery_count, 1U);
  EXPECT_EQ(facts->discovery[0].first, 7);
  EXPECT_EQ(facts->discovery[0].last, 7);
  EXPECT_FALSE(facts->discovery[0].announced);
}

TEST_F(MessageTest, BoundsWhatFastDdsWalksThrough) {
  EXPECT_EQ(of(SubmessageId::kGap, 0, gap(1, 5)), Fault::kNone);
  EXPECT_EQ(of(SubmessageId::kGap, 0, gap(5, 5)), Fault::kNone);
  EXPECT_EQ(of(SubmessageId::kGap, 0, gap(0, 5)), Fault::kSequence);
  EXPECT_EQ(of(SubmessageId::kGap, 0, gap(1, 0)), Fault::kSequence);
  EXPECT_EQ(of(SubmessageId::kGap, 0, gap(1, kMaxGap + 1)), Fault::kNone);
  EXPECT_EQ(of(SubmessageId::kGap, 0, gap(1, kMaxGap + 2)), Fault::kSequence);
  EXPECT_EQ(of(SubmessageId::kGap, 0, gap(1, 0x7fffffffffffffff)), Fault::kSequence);
}

TEST_F(MessageTest, ChecksFragmentRequests) {
  const auto nack = [](std::uint32_t base, std::uint32_t bits, std::size_t words) {
    Octets fields = Octets().entity(0).entity(0x103).sequence(4).u32(base).u32(bits);
    for (std::size_t i = 0; i < words; ++i) fields.u32(1);
    return fields.u32(1);
  };
  EXPECT_EQ(of(SubmessageId::kNackFrag, 0, nack(1, 32, 1)), Fault::kNone);
  EXPECT_EQ(of(SubmessageId::kNackFrag, 0, nack(0, 32, 1)), Fault::kNumberSet);
  EXPECT_EQ(of(SubmessageId::kNackFrag, 0, nack(1, 300, 10)), Fault::kNumberSet);
  EXPECT_EQ(of(SubmessageId::kNackFrag, 0, nack(1, 64, 1)), Fault::kSubmessage);
}

TEST_F(MessageTest, ChecksSampleNumbersAndFlags) {
  const Octets payload = Octets().u8({0, 1, 0, 0}).u32(7);
  EXPECT_EQ(of(SubmessageId::kData, 4, data_fields(0x104, 0x103, 1, {}, payload)), Fault::kNone);
  EXPECT_EQ(of(SubmessageId::kData, 4, data_fields(0x104, 0x103, 0, {}, payload)), Fault::kSequence);
  EXPECT_EQ(of(SubmessageId::kData, 4, data_fields(0x104, 0x103, -5, {}, payload)), Fault::kSequence);
  EXPECT_EQ(of(SubmessageId::kData, 12, data_fields(0x104, 0x103, 1, {}, payload)), Fault::kPayload);
  EXPECT_EQ(of(SubmessageId::kData, 4, data_fields(0x104, 0x103, 1, {}, {})), Fault::kPayload);
  EXPECT_EQ(of(SubmessageId::kData, 0, data_fields(0x104, 0x103, 1, {}, {})), Fault::kNone);
  EXPECT_EQ(of(SubmessageId::kData, 2, data_fields(0x104, 0x103, 1, Octets().u32(0), {})), Fault::kInlineQos);
}

TEST_F(MessageTest, RefusesOffsetsThatLeadAway) {
  const Octets payload = Octets().u8({0, 1, 0, 0}).u32(7);
  for (const std::uint32_t offset : {0u, 8u, 15u, 200u, 0x7fffu, 0x8000u, 0xffffu}) {
    Octets fields = data_fields(0x104, 0x103, 1, {}, payload);
    fields.bytes[2] = static_cast<std::uint8_t>(offset);
    fields.bytes[3] = static_cast<std::uint8_t>(offset >> 8);
    EXPECT_NE(of(SubmessageId::kData, 4, fields), Fault::kNone) << offset;
  }
}

TEST_F(MessageTest, LetsBuiltInReadersHearTheirOwnWriterOnly) {
  const Octets payload = test::encapsulated(test::participant_list().sentinel());
  EXPECT_EQ(of(SubmessageId::kData, 4, data_fields(0, kParticipantWriter, 1, {}, payload)), Fault::kNone);
  EXPECT_EQ(of(SubmessageId::kData, 4, data_fields(kParticipantReader, 0x103, 1, {}, payload)),
            Fault::kEndpoint);
  EXPECT_EQ(of(SubmessageId::kData, 4, data_fields(0x104, kParticipantWriter, 1, {}, payload)),
            Fault::kEndpoint);
}

TEST_F(MessageTest, ChecksLivelinessAndItsLength) {
  const auto alive = [](std::uint32_t stated) {
    return Octets().u8({0, 1, 0, 0}).raw(test::kPeer).u8({0, 0, 0, 1}).u32(stated).u32(0);
  };
  const auto fault = [&](std::uint32_t stated) {
    return of(SubmessageId::kData, 4,
              data_fields(kLivelinessReader, kLivelinessWriter, 1, {}, alive(stated)));
  };
  EXPECT_EQ(fault(4), Fault::kNone);
  EXPECT_EQ(fault(5), Fault::kPayload);
  EXPECT_EQ(fault(0xffffffff), Fault::kPayload);
}

TEST_F(MessageTest, ChecksHandshakes) {
  const auto fault = [&](const Octets& payload) {
    return of(SubmessageId::kData, 4, data_fields(kStatelessReader, kStatelessWriter, 1, {}, payload));
  };
  EXPECT_EQ(fault(test::handshake_payload(1)), Fault::kNone);
  EXPECT_TRUE(facts->handshake);
  EXPECT_EQ(fault(test::handshake_payload(2)), Fault::kHandshake);
  EXPECT_EQ(fault(test::handshake_payload(0xffffffff)), Fault::kHandshake);
  const Octets whole = test::handshake_payload(1);
  for (std::size_t size = 4; size < whole.bytes.size(); size += 4) {
    Octets cut;
    cut.raw(std::span(whole.bytes).first(size));
    EXPECT_NE(fault(cut), Fault::kNone) << size;
  }
}

TEST_F(MessageTest, HoldsFragmentsAgainstTheirNumbers) {
  const auto fault = [&](const test::Fragments& f) { return check(message({fragment_submessage(f)})); };
  EXPECT_EQ(fault({}), Fault::kNone);
  ASSERT_EQ(facts->fragment_count, 1u);
  EXPECT_EQ(facts->fragments[0].size, 64u);
  EXPECT_EQ(fault({.first = 2}), Fault::kNone);
  EXPECT_EQ(fault({.first = 1, .count = 2, .carried = 128}), Fault::kNone);
  EXPECT_EQ(fault({.first = 2, .sample_bytes = 100, .carried = 36}), Fault::kNone)
      << "the last one is shorter";
  EXPECT_EQ(fault({.first = 2, .sample_bytes = 98, .carried = 36}), Fault::kNone) << "with padding";
  EXPECT_EQ(fault({.first = 0}), Fault::kFragment);
  EXPECT_EQ(fault({.first = 3}), Fault::kFragment);
  EXPECT_EQ(fault({.first = 0xffffffff}), Fault::kFragment);
  EXPECT_EQ(fault({.count = 0}), Fault::kFragment);
  EXPECT_EQ(fault({.count = 3, .carried = 192}), Fault::kFragment);
  EXPECT_EQ(fault({.fragment_bytes = 0}), Fault::kFragment);
  EXPECT_EQ(fault({.sample_bytes = 0}), Fault::kFragment);
  EXPECT_EQ(fault({.carried = 60}), Fault::kFragment);
  EXPECT_EQ(fault({.carried = 68}), Fault::kFragment);
  EXPECT_EQ(fault({.first = 2, .sample_bytes = 0xffffffff}), Fault::kNone);
}

// Fast DDS writes the list of missing fragments into the sample: smaller fragments would overwrite each other
// and what lies behind it.
TEST_F(MessageTest, RefusesFragmentsTooSmallForFastDdsToCount) {
  const auto fault = [&](std::uint32_t fragment, std::uint32_t sample) {
    return check(message({fragment_submessage(
        {.fragment_bytes = fragment, .sample_bytes = sample, .carried = std::min(fragment, sample)})}));
  };
  for (const std::uint32_t size : {1u, 2u, 3u}) EXPECT_EQ(fault(size, 64), Fault::kFragment);
  EXPECT_EQ(fault(4, 64), Fault::kNone);
  EXPECT_EQ(fault(4, 62), Fault::kNone);
  EXPECT_EQ(fault(5, 11), Fault::kFragment) << "the third would be counted behind the sample";
  EXPECT_EQ(fault(5, 20), Fault::kNone);
}

TEST_F(MessageTest, ChecksSecuredFrames) {
  Octets head;
  head.bytes.resize(20);
  const Octets body = Octets().u8({0, 0, 0, 8}).u32(0).u32(0);
  Octets foot;
  foot.bytes.resize(20);
  const auto prefix = submessage(SubmessageId::kSecurePrefix, 0, head),
             sealed = submessage(SubmessageId::kSecureBody, 0, body),
             postfix = submessage(SubmessageId::kSecurePostfix, 0, foot);
  EXPECT_EQ(check(message({prefix, sealed, postfix}), true), Fault::kNone);
  EXPECT_EQ(check(message({prefix, sealed, postfix}), false), Fault::kNone);
  EXPECT_EQ(check(message({prefix, sealed}), true), Fault::kSecured);
  EXPECT_EQ(check(message({sealed, postfix}), true), Fault::kSecured);
  EXPECT_EQ(check(message({prefix, prefix, postfix}), true), Fault::kSecured);
  EXPECT_EQ(check(message({prefix, sealed, sealed, postfix}), true), Fault::kSecured);

  const auto whole_prefix = submessage(SubmessageId::kSecureRtpsPrefix, 0, head),
             whole_postfix = submessage(SubmessageId::kSecureRtpsPostfix, 0, foot);
  EXPECT_EQ(check(message({whole_prefix, sealed, whole_postfix}), true), Fault::kNone);
  EXPECT_EQ(check(message({whole_prefix, sealed}), true), Fault::kSecured);
  EXPECT_EQ(check(message({whole_prefix, sealed, whole_postfix, sealed}), true), Fault::kSecured);
  EXPECT_EQ(check(message({whole_prefix, sealed, whole_postfix,
                           submessage(SubmessageId::kHeartbeat, 0, heartbeat(1, 5))}),
                  true),
            Fault::kSecured);
  const auto statistics = submessage(kFirstOfVendors, 1, Octets().u32(7));
  EXPECT_EQ(check(message({whole_prefix, sealed, whole_postfix, statistics}), true), Fault::kNone);
  EXPECT_EQ(check(message({whole_prefix, sealed, statistics}), true), Fault::kSecured);

  Octets short_head;
  short_head.bytes.resize(16);
  EXPECT_EQ(of(SubmessageId::kSecurePrefix, 0, short_head), Fault::kSecured);
  Octets macs = foot;
  macs.bytes[19] = 3;  // receivers' signatures that are not there
  EXPECT_EQ(check(message({prefix, sealed, submessage(SubmessageId::kSecurePostfix, 0, macs)}), true),
            Fault::kSecured);
  const auto over = submessage(SubmessageId::kSecureBody, 0, Octets().u8({0, 0, 1, 0}).u32(0));
  EXPECT_EQ(check(message({prefix, over, postfix}), true), Fault::kSecured);
}

// A participant without security reads what stands in a frame as if the frame were not there.
TEST_F(MessageTest, LooksIntoFramesForAParticipantWithoutSecurity) {
  Octets head;
  head.bytes.resize(20);
  const auto prefix = submessage(SubmessageId::kSecurePrefix, 0, head),
             postfix = submessage(SubmessageId::kSecurePostfix, 0, head),
             bad = fragment_submessage({.first = 0});
  EXPECT_EQ(check(message({prefix, bad, postfix}), false), Fault::kFragment);
  EXPECT_EQ(check(message({prefix, bad, postfix}), true), Fault::kNone)
      << "read only if its signature is right";
  EXPECT_EQ(check(message({bad, prefix, bad, postfix}), true), Fault::kFragment);
}

TEST_F(MessageTest, BoundsWhatOneDatagramMayHold) {
  std::vector<std::uint8_t> many = test::header();
  for (std::size_t i = 0; i <= MessageFacts::kMax; ++i) {
    const auto one = fragment_submessage({.fragment_bytes = 4, .sample_bytes = 8, .carried = 4});
    many.insert(many.end(), one.begin(), one.end());
  }
  EXPECT_EQ(check(many), Fault::kSubmessage);
}

TEST(Fault, HasWordsForEach) {
  for (std::size_t i = 0; i < kFaults; ++i)
    EXPECT_GT(std::string(words_of(static_cast<Fault>(i))).size(), 4u);
}

}  // namespace
}  // namespace phantom::wire
