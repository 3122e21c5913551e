#include "common/wire/whole_samples.hpp"

#include <gmock/gmock.h>

#include "common/wire/message.hpp"
#include "common/wire/tests/guard_fixture.hpp"

namespace phantom::wire {
namespace {

using test::fragment_submessage;
using test::GuardTest;
using test::kHost;
using test::kSecond;
using test::message;
using test::Octets;
using test::peer;
using test::submessage;

constexpr EntityId kKeyless = 0x00000103, kKeyed = 0x00000102, kWholeAlone = 0x00000203;

/// A DATA of a user's writer: its flags beside the byte order, its inline QoS (with its sentinel, or empty).
std::vector<std::uint8_t> user_data(EntityId writer, std::uint8_t flags, std::int64_t sequence,
                                    bool little_endian, const Octets& inline_qos,
                                    const std::vector<std::uint8_t>& payload) {
  Octets fields(little_endian);
  fields.u16(0).u16(16).entity(0x104).entity(writer).sequence(sequence).raw(inline_qos.bytes).raw(payload);
  return submessage(SubmessageId::kData, flags, fields);
}

Octets a_key_hash(bool little_endian) {
  Octets list(little_endian);
  list.parameter(Pid::kKeyHash,
                 Octets(little_endian).u8({1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16}));
  return list.sentinel();
}

/// Rewrites a message of which the two writers of number 1 are said to send fragments.
std::vector<std::uint8_t> rewritten(std::vector<std::uint8_t> datagram) {
  const FragmentingWriters writers{
      [](void*, const Guid& writer) { return writer.entity >> 8 == 1 && writer.prefix == peer(1); }, nullptr};
  std::vector<std::uint8_t> room(datagram.size() + kMostGrown);
  const auto used = as_fragments(datagram, writers, room);
  return {used.begin(), used.end()};
}

class WholeSamples : public ::testing::TestWithParam<bool> {};  // little-endian

TEST_P(WholeSamples, AreOneFragmentThatHoldsTheSameOctets) {
  const std::vector<std::uint8_t> payload{0, 1, 0, 0, 11, 12, 13, 14, 15};
  for (const bool with_list : {false, true}) {
    const Octets list = with_list ? a_key_hash(GetParam()) : Octets();
    const auto time = submessage(SubmessageId::kInfoTimestamp, 0, Octets(GetParam()).u32(7).u32(8));
    auto datagram =
        message({time, user_data(kWholeAlone, 4, 5, GetParam(), Octets(), {0, 1, 0, 0, 1, 2, 3, 4}),
                 user_data(kKeyless, with_list ? 6 : 4, 1LL << 33 | 9, GetParam(), list, payload)},
                peer(1));
    const auto made = rewritten(datagram);
    ASSERT_EQ(made.size(), datagram.size() + 12);
    // All before it stays, and so do its end points, its number, its list and its payload.
    const std::size_t ours = datagram.size() - payload.size() - list.bytes.size() - 24;
    EXPECT_TRUE(std::equal(made.begin(), made.begin() + static_cast<std::ptrdiff_t>(ours), datagram.begin()));
    auto checked = made;
    const auto facts = std::make_unique<MessageFacts>();
    ASSERT_EQ(check_message(checked, {}, *facts), Fault::kNone);
    ASSERT_EQ(facts->fragment_count, 1u);
    const FragmentFact& fact = facts->fragments[0];
    EXPECT_EQ(fact.writer, (Guid{peer(1), kKeyless}));
    EXPECT_EQ(fact.reader, 0x104u);
    EXPECT_EQ(fact.sequence, 1LL << 33 | 9);
    EXPECT_EQ(fact.first, 1u);
    EXPECT_EQ(fact.count, 1u);
    EXPECT_EQ(fact.sample_bytes, payload.size());
    EXPECT_EQ(fact.fragment_bytes, payload.size());
    EXPECT_EQ(fact.place.begin, ours);
    EXPECT_EQ(std::vector<std::uint8_t>(made.begin() + static_cast<std::ptrdiff_t>(fact.at),
                                        made.begin() + static_cast<std::ptrdiff_t>(fact.at + fact.size)),
              payload);
    EXPECT_TRUE(std::equal(list.bytes.rbegin(), list.bytes.rend(),
                           made.rbegin() + static_cast<std::ptrdiff_t>(payload.size())));
  }
}

TEST_P(WholeSamples, EachOfAMessageIsOneFragment) {
  std::vector<std::vector<std::uint8_t>> parts;
  for (int i = 1; i <= 100; ++i)
    parts.push_back(
        user_data(kKeyless, 4, i, GetParam(), Octets(), {0, 1, 0, 0, 1, 2, 3, static_cast<std::uint8_t>(i)}));
  Octets all;
  for (const auto& part : parts) all.raw(part);
  const auto made = rewritten(message({all.bytes}, peer(1)));
  auto checked = made;
  const auto facts = std::make_unique<MessageFacts>();
  ASSERT_EQ(check_message(checked, {}, *facts), Fault::kNone);
  ASSERT_EQ(facts->fragment_count, parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) {
    EXPECT_EQ(facts->fragments[i].sequence, static_cast<std::int64_t>(i + 1));
    EXPECT_EQ(made[facts->fragments[i].at + 7], i + 1);
  }
}

TEST_P(WholeSamples, WithoutDataArePaddingAndThoseWithKeysStay) {
  const auto disposed = [&](EntityId writer) {
    return message({user_data(writer, 2, 3, GetParam(), a_key_hash(GetParam()), {})}, peer(1));
  };
  auto made = rewritten(disposed(kKeyless));
  ASSERT_EQ(made.size(), disposed(kKeyless).size());
  EXPECT_EQ(made[kHeaderBytes], static_cast<std::uint8_t>(SubmessageId::kPad));
  const auto facts = std::make_unique<MessageFacts>();
  EXPECT_EQ(check_message(made, {}, *facts), Fault::kNone);
  EXPECT_TRUE(rewritten(disposed(kKeyed)).empty()) << "an instance that is gone";
  EXPECT_TRUE(
      rewritten(message({user_data(kKeyed, 4, 3, GetParam(), Octets(), {0, 1, 0, 0, 1, 2, 3, 4})}, peer(1)))
          .empty());
}

TEST_P(WholeSamples, OfWritersWithoutFragmentsStay) {
  const std::vector<std::uint8_t> payload{0, 1, 0, 0, 1, 2, 3, 4};
  EXPECT_TRUE(
      rewritten(message({user_data(kWholeAlone, 4, 1, GetParam(), Octets(), payload)}, peer(1))).empty());
  EXPECT_TRUE(
      rewritten(message({user_data(kKeyless, 4, 1, GetParam(), Octets(), payload)}, peer(2))).empty());
  EXPECT_TRUE(rewritten(test::endpoint_announcement({peer(1), kKeyless})).empty());
}

INSTANTIATE_TEST_SUITE_P(In, WholeSamples, ::testing::Bool(),
                         [](const auto& param) { return param.param ? "LittleEndian" : "BigEndian"; });

struct HeardInFragments : GuardTest {
  HeardInFragments() : GuardTest({.whole_as_fragments = true}) {}

  Fault hear_whole(EntityId writer = kKeyless) {
    return receive(message({user_data(writer, 4, 7, true, Octets(), {0, 1, 0, 0, 1, 2, 3, 4})}, peer(1)),
                   kHost, 2 * kSecond, false);
  }
};

TEST_F(HeardInFragments, IsAWriterOnceItHasSentOne) {
  receive(test::announcement(peer(1)));
  ASSERT_EQ(hear_whole(), Fault::kNone);
  EXPECT_TRUE(guard.rewritten().empty());
  ASSERT_EQ(receive(message({fragment_submessage({.writer = kKeyless})}, peer(1))), Fault::kNone);
  EXPECT_TRUE(guard.rewritten().empty());
  ASSERT_EQ(hear_whole(), Fault::kNone);
  ASSERT_EQ(guard.rewritten().size(), last.size() + 12);
  EXPECT_EQ(guard.rewritten()[kHeaderBytes], static_cast<std::uint8_t>(SubmessageId::kDataFrag));
  ASSERT_EQ(hear_whole(kWholeAlone), Fault::kNone);
  EXPECT_TRUE(guard.rewritten().empty());
  // In one datagram with a fragment, too.
  ASSERT_EQ(receive(message({fragment_submessage({.writer = kWholeAlone, .first = 2}),
                             user_data(kWholeAlone, 4, 9, true, Octets(), {0, 1, 0, 0, 1, 2, 3, 4})},
                            peer(1))),
            Fault::kNone);
  EXPECT_EQ(guard.rewritten().size(), last.size() + 12);
}

TEST_F(GuardTest, LeavesWholeSamplesAsTheyAreWhereFastDdsTakesBoth) {
  receive(test::announcement(peer(1)));
  receive(message({fragment_submessage({.writer = kKeyless})}, peer(1)));
  receive(message({user_data(kKeyless, 4, 7, true, Octets(), {0, 1, 0, 0, 1, 2, 3, 4})}, peer(1)));
  EXPECT_TRUE(guard.rewritten().empty());
}

}  // namespace
}  // namespace phantom::wire
