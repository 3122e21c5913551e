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

constexpr EntityId kKeyless = 0x00000103, kKeyed = 0x00000102, kAnother = 0x00000203;

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

const std::vector<std::uint8_t> kPayload{0, 1, 0, 0, 11, 12, 13, 14, 15};

std::vector<std::uint8_t> whole_sample(EntityId writer, std::int64_t sequence) {
  return user_data(writer, 4, sequence, true, Octets(), kPayload);
}

/// One of a sample's two fragments.
std::vector<std::uint8_t> half_sample(EntityId writer, std::int64_t sequence, std::uint32_t which) {
  return fragment_submessage({.writer = writer, .sequence = sequence, .first = which});
}

std::vector<std::uint8_t> joined(const std::vector<std::vector<std::uint8_t>>& parts) {
  Octets all;
  for (const auto& part : parts) all.raw(part);
  return all.bytes;
}

struct WholeSamplesTest : ::testing::Test {
  /// What stands in place of a message of peer(1); empty: the message itself.
  std::vector<std::uint8_t> in_place_of(const std::vector<std::vector<std::uint8_t>>& parts,
                                        const GuidPrefix& from = peer(1)) {
    const auto datagram = message({joined(parts)}, from);
    std::vector<std::uint8_t> room(datagram.size() + kMaxGrown);
    const auto used = samples->rewrite(datagram, room);
    return {used.begin(), used.end()};
  }
  bool is_rewritten(EntityId writer, std::int64_t sequence) {
    return !in_place_of({whole_sample(writer, sequence)}).empty();
  }

  std::unique_ptr<FragmentReassembler> samples = std::make_unique<FragmentReassembler>();
};

struct WholeSamplesInOrder : WholeSamplesTest, ::testing::WithParamInterface<bool> {};  // little-endian

TEST_P(WholeSamplesInOrder, AreOneFragmentThatHoldsTheSameOctets) {
  for (const bool with_list : {false, true}) {
    in_place_of({half_sample(kKeyless, 1, 1)});
    const Octets list = with_list ? a_key_hash(GetParam()) : Octets();
    const auto time = submessage(SubmessageId::kInfoTimestamp, 0, Octets(GetParam()).u32(7).u32(8));
    const std::vector<std::vector<std::uint8_t>> parts{
        time, user_data(kAnother, 4, 5, GetParam(), Octets(), {0, 1, 0, 0, 1, 2, 3, 4}),
        user_data(kKeyless, with_list ? 6 : 4, 1LL << 33 | 9, GetParam(), list, kPayload)};
    const auto datagram = message({joined(parts)}, peer(1));
    const auto made = in_place_of(parts);
    ASSERT_EQ(made.size(), datagram.size() + 12);
    // All before it stays, and so do its end points, its number, its list and its payload.
    const std::size_t ours = datagram.size() - kPayload.size() - list.bytes.size() - 24;
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
    EXPECT_EQ(fact.sample_bytes, kPayload.size());
    EXPECT_EQ(fact.fragment_bytes, kPayload.size());
    EXPECT_EQ(fact.place.begin, ours);
    EXPECT_EQ(std::vector<std::uint8_t>(made.begin() + static_cast<std::ptrdiff_t>(fact.at),
                                        made.begin() + static_cast<std::ptrdiff_t>(fact.at + fact.size)),
              kPayload);
    EXPECT_TRUE(std::equal(list.bytes.rbegin(), list.bytes.rend(),
                           made.rbegin() + static_cast<std::ptrdiff_t>(kPayload.size())));
  }
}

INSTANTIATE_TEST_SUITE_P(In, WholeSamplesInOrder, ::testing::Bool(),
                         [](const auto& param) { return param.param ? "LittleEndian" : "BigEndian"; });

TEST_F(WholeSamplesTest, OnlyTheNextOneAfterALostFragmentIsAFragment) {
  EXPECT_FALSE(is_rewritten(kKeyless, 1)) << "nothing was lost";
  in_place_of({half_sample(kKeyless, 2, 1)});
  EXPECT_TRUE(samples->awaits(peer(1)));
  EXPECT_FALSE(samples->awaits(peer(2)));
  EXPECT_FALSE(is_rewritten(kAnother, 3));
  EXPECT_TRUE(in_place_of({whole_sample(kKeyless, 3)}, peer(2)).empty()) << "of another participant";
  EXPECT_FALSE(is_rewritten(kKeyless, 2)) << "no later one";
  EXPECT_TRUE(is_rewritten(kKeyless, 3));
  EXPECT_FALSE(samples->awaits(peer(1)));
  EXPECT_FALSE(is_rewritten(kKeyless, 4));
}

TEST_F(WholeSamplesTest, FragmentsOfWhichNoneIsLostChangeNothing) {
  for (const std::uint32_t first : {1u, 2u}) {  // in either order
    in_place_of({half_sample(kKeyless, first * 10, first), half_sample(kKeyless, first * 10, first)});
    EXPECT_TRUE(samples->awaits(peer(1))) << "one came twice, and one is missing";
    in_place_of({half_sample(kKeyless, first * 10, 3 - first)});
    EXPECT_FALSE(samples->awaits(peer(1)));
    EXPECT_FALSE(is_rewritten(kKeyless, first * 10 + 1));
  }
}

TEST_F(WholeSamplesTest, AnOlderSamplesFragmentDoesNotCompleteTheNewest) {
  in_place_of({half_sample(kKeyless, 5, 1)});
  in_place_of({half_sample(kKeyless, 4, 2)});
  EXPECT_TRUE(is_rewritten(kKeyless, 6));
  in_place_of({half_sample(kKeyless, 7, 1)});
  in_place_of({half_sample(kKeyless, 8, 2)});
  EXPECT_TRUE(is_rewritten(kKeyless, 9)) << "the fragments are of two samples";
}

TEST_F(WholeSamplesTest, OneMessageIsReadInItsOrder) {
  EXPECT_FALSE(in_place_of({half_sample(kKeyless, 1, 1), whole_sample(kKeyless, 2)}).empty());
  EXPECT_TRUE(in_place_of({whole_sample(kKeyless, 3), half_sample(kKeyless, 4, 1)}).empty());
  EXPECT_FALSE(in_place_of({whole_sample(kKeyless, 5), half_sample(kKeyless, 6, 1)}).empty());
  EXPECT_FALSE(is_rewritten(kKeyless, 6));
  EXPECT_TRUE(is_rewritten(kKeyless, 7));
}

TEST_F(WholeSamplesTest, WithKeysAndWithoutDataStay) {
  in_place_of({half_sample(kKeyed, 1, 1), half_sample(kKeyless, 1, 1)});
  EXPECT_FALSE(is_rewritten(kKeyed, 2));
  EXPECT_TRUE(in_place_of({user_data(kKeyless, 2, 2, true, a_key_hash(true), {})}).empty());
  EXPECT_TRUE(is_rewritten(kKeyless, 3)) << "a fragment is missing as before";
}

TEST_F(WholeSamplesTest, ASampleOfMoreFragmentsThanAreCountedIsNeverComplete) {
  for (std::uint32_t first = 1; first <= 5000; ++first)
    in_place_of({fragment_submessage({.writer = kKeyless,
                                      .sequence = 1,
                                      .first = first,
                                      .fragment_bytes = 1,
                                      .sample_bytes = 5000,
                                      .carried = 1})});
  EXPECT_TRUE(is_rewritten(kKeyless, 2));
}

TEST_F(WholeSamplesTest, ForgetTheOldestOfTooManyWriters) {
  const auto writer = [](std::size_t i) { return static_cast<EntityId>((i + 1) << 8U | 0x03U); };
  for (std::size_t i = 0; i <= FragmentReassembler::kMaxWriters; ++i)
    in_place_of({half_sample(writer(i), 1, 1)});
  EXPECT_FALSE(is_rewritten(writer(0), 2));
  for (std::size_t i = 1; i <= FragmentReassembler::kMaxWriters; ++i)
    EXPECT_TRUE(is_rewritten(writer(i), 2)) << i;
  EXPECT_FALSE(samples->awaits(peer(1)));
}

struct GuardAgainstMixedSamples : GuardTest {
  explicit GuardAgainstMixedSamples(bool secured = false)
      : GuardTest({.receiver = {.secured = secured}, .crashes_on_interleaved_fragments = true}) {}
};

TEST_F(GuardAgainstMixedSamples, HandsOnTheNextWholeOneAsAFragment) {
  receive(test::announcement(peer(1)));
  ASSERT_EQ(receive(message({half_sample(kKeyless, 1, 1)}, peer(1))), Fault::kNone);
  EXPECT_TRUE(guard.rewritten().empty());
  ASSERT_EQ(receive(message({whole_sample(kKeyless, 2)}, peer(1))), Fault::kNone);
  ASSERT_EQ(guard.rewritten().size(), last.size() + 12);
  EXPECT_EQ(guard.rewritten()[kHeaderBytes], static_cast<std::uint8_t>(SubmessageId::kDataFrag));
  ASSERT_EQ(receive(message({whole_sample(kKeyless, 3)}, peer(1))), Fault::kNone);
  EXPECT_TRUE(guard.rewritten().empty());
}

struct SecuredGuardAgainstMixedSamples : GuardAgainstMixedSamples {
  SecuredGuardAgainstMixedSamples() : GuardAgainstMixedSamples(true) {}
};

TEST_F(SecuredGuardAgainstMixedSamples, LeavesWhatMayBeSigned) {
  receive(test::announcement(peer(1)));
  ASSERT_EQ(receive(message({half_sample(kKeyless, 1, 1)}, peer(1))), Fault::kNone);
  ASSERT_EQ(receive(message({whole_sample(kKeyless, 2)}, peer(1))), Fault::kNone);
  EXPECT_TRUE(guard.rewritten().empty());
}

TEST_F(GuardTest, LeavesWholeSamplesAsTheyAreWhereFastDdsTakesBoth) {
  receive(test::announcement(peer(1)));
  receive(message({half_sample(kKeyless, 1, 1)}, peer(1)));
  receive(message({whole_sample(kKeyless, 2)}, peer(1)));
  EXPECT_TRUE(guard.rewritten().empty());
}

}  // namespace
}  // namespace phantom::wire
