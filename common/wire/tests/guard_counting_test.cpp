// What readers may be made to count, and to keep.
#include <gtest/gtest.h>

#include <map>
#include <random>

#include "common/wire/tests/guard_fixture.hpp"

namespace phantom::wire {
namespace {

using test::GuardTest;
using test::kFar;
using test::kHost;
using test::kSecond;
using test::message;
using test::peer;

constexpr EntityId kUserWriter = 0x103;

struct Counting : GuardTest {
  Counting()
      : GuardTest({.counted_per_s = 1000,
                   .counted_burst = 100'000,
                   .repeated_per_s = 10'000,
                   .repeated_burst = 20'000}) {
    receive(test::announcement(peer(1)));
  }
  Fault begins(std::int64_t first, EntityId writer = kUserWriter, core::Nanoseconds at = kSecond) {
    return receive(test::heartbeat({peer(1), writer}, first, first), kHost, at, false);
  }
};

TEST_F(Counting, RefusesFirstSamplesThatCannotBe) {
  EXPECT_EQ(begins(std::int64_t{1} << 62), Fault::kCounting);
  EXPECT_EQ(begins(Guard::kMaxStep + 2), Fault::kCounting);
  EXPECT_EQ(begins(Guard::kMaxStepOfDiscovery + 2, kPublicationWriter), Fault::kCounting);
  EXPECT_EQ(begins(Guard::kMaxStepOfDiscovery + 1, kPublicationWriter), Fault::kNone);
}

// A writer that has been up for long is joined late: one long step passes, and the next must wait for it.
TEST_F(Counting, LetsOneLongStepPassAndThenOthersWait) {
  EXPECT_EQ(begins(1'000'000), Fault::kNone);
  EXPECT_EQ(begins(1'000'000), Fault::kNone) << "it is there already";
  EXPECT_EQ(begins(1'000'900), Fault::kNone) << "few are its own";
  EXPECT_EQ(begins(1'010'000), Fault::kCounting);
  EXPECT_EQ(begins(900'000), Fault::kNone) << "readers do not count backwards";
  EXPECT_EQ(begins(1'010'000, kUserWriter, 903 * kSecond), Fault::kNone);
}

TEST_F(Counting, CountsAnewForAWriterThatWasClosed) {
  const Guid writer{peer(1), kUserWriter};
  ASSERT_EQ(receive(test::endpoint_announcement(writer)), Fault::kNone);
  ASSERT_EQ(begins(1'000'000), Fault::kNone);
  const test::Octets closed = test::Octets()
                                  .parameter(Pid::kKeyHash, test::Octets().guid(writer))
                                  .parameter(Pid::kStatusInfo, test::Octets().u8({0, 0, 0, 3}))
                                  .sentinel();
  ASSERT_EQ(receive(message({test::submessage(SubmessageId::kData, 2,
                                              test::data_fields(kPublicationReader, kPublicationWriter, 2,
                                                                closed, test::Octets()))},
                            peer(1))),
            Fault::kNone);
  EXPECT_EQ(begins(1'000'000), Fault::kCounting) << "a reader that matches it again begins at the start";
}

TEST_F(Counting, BoundsWhatGapsMakeReadersKeep) {
  const Guid writer{peer(1), kUserWriter};
  EXPECT_EQ(receive(test::gap(writer, 10, 60)), Fault::kNone);
  EXPECT_EQ(receive(test::gap(writer, 10, 50'000)), Fault::kNone);
  EXPECT_EQ(receive(test::gap(writer, 50'000, 50'100)), Fault::kCounting);
}

// A writer with many instances has gaps in its history. It repeats them with each sample until all readers
// have acknowledged it.
TEST_F(Counting, HolesThatAreToldAgainAndAgainCostLittleAndTakeNoSampleAlong) {
  const Guid writer{peer(1), kUserWriter};
  std::int64_t next = 1700;  // the first are there still
  int passed = 0, told = 0;
  for (int k = 0; k < 3000; ++k) {  // a minute
    const core::Nanoseconds at = kSecond + k * (kSecond / 50);
    next += 2;
    for (std::int64_t hole = 1701; hole < next; hole += 2000, ++told)
      passed += receive(test::gap(writer, hole, std::min(hole + 2000, next)), kHost, at) == Fault::kNone;
  }
  EXPECT_EQ(passed, told) << "all are passed, or hidden in what is passed";
}

// Numbers far ahead must not make those before them cheap.
TEST_F(Counting, AGapFarAheadDoesNotPayForThoseBeforeIt) {
  const Guid writer{peer(1), kUserWriter};
  EXPECT_EQ(receive(test::gap(writer, 2'000'000, 2'000'010)), Fault::kNone);
  EXPECT_EQ(receive(test::gap(writer, 1, 6400)), Fault::kNone) << "for all of the budget";
  EXPECT_EQ(receive(test::gap(writer, 6400, 6500)), Fault::kCounting);
}

TEST_F(Counting, WhatLiesBetweenTwoGapsIsPaidForAndCheapAfterwards) {
  const Guid writer{peer(1), kUserWriter};
  EXPECT_EQ(receive(test::gap(writer, 5000, 5010)), Fault::kNone) << "5000 times 16 of 100,000";
  EXPECT_EQ(receive(test::gap(writer, 20, 4900)), Fault::kNone) << "known";
  EXPECT_EQ(receive(test::gap(writer, 5010, 5500)), Fault::kNone);
  EXPECT_EQ(receive(test::gap(writer, 5500, 7000)), Fault::kNone) << "for all of the budget";
  EXPECT_EQ(receive(test::gap(writer, 7000, 7100)), Fault::kCounting);
}

// Whatever GAPs come within a minute, the numbers that were not declared missing before are bounded.
TEST_F(Counting, BoundsWhatAnySequenceOfGapsDeclaresMissing) {
  std::mt19937_64 random(11);
  std::vector<bool> missing(400'000, false);
  std::size_t new_ones = 0;
  for (int k = 0; k < 20'000; ++k) {
    const auto start = static_cast<std::int64_t>(1 + random() % 300'000);
    const auto end = start + static_cast<std::int64_t>(random() % (random() % 4 == 0 ? 2000 : 200));
    const core::Nanoseconds at = kSecond + k * (kSecond / 400);
    auto datagram = test::gap({peer(1), kUserWriter}, start, end);
    if (receive(datagram, kHost, at) != Fault::kNone) continue;
    constexpr std::size_t kHeader = 20;
    if (last[kHeader] == static_cast<std::uint8_t>(SubmessageId::kPad)) continue;  // hidden
    for (std::int64_t n = start; n < end; ++n) {
      new_ones += !missing[static_cast<std::size_t>(n)];
      missing[static_cast<std::size_t>(n)] = true;
    }
  }
  // Of both budgets: the participant's own, and its address's.
  const double budget = 100'000 + 50.0 * 1000 + Participant::kCountedBurst + 50.0 * Participant::kCountedPerS;
  // The last GAP that passes may take more than was left.
  EXPECT_LE(static_cast<double>(new_ones), budget / Guard::kCostOfMissing + 2000);
  EXPECT_GT(new_ones, 1000U);
}

TEST_F(Counting, LeavesTheBudgetOfAnotherAddress) {
  EXPECT_EQ(begins(1'000'000), Fault::kNone);
  receive(test::announcement(peer(2)), kFar);
  EXPECT_EQ(receive(test::heartbeat({peer(2), kUserWriter}, 90'000, 90'000), kFar), Fault::kNone);
}

// Whatever comes within a minute, a reader counts no further than the budget.
TEST_F(Counting, BoundsWhatAnySequenceOfHeartbeatsCosts) {
  std::mt19937_64 random(7);
  std::map<std::pair<int, EntityId>, std::int64_t> low_marks;
  std::int64_t counted = 0;
  for (int i = 0; i < 200'000; ++i) {
    const int who = static_cast<int>(random() % 200);
    const EntityId writer = random() % 2 == 0 ? kUserWriter : kLivelinessWriter;
    const auto at = kSecond + i * (60 * kSecond / 200'000);
    if (receive(test::announcement(peer(who)), kHost, at) != Fault::kNone)
      continue;  // Fast DDS knows nothing
    const auto first = static_cast<std::int64_t>(random() >> (2 + random() % 62));
    if (first < 1) continue;
    if (receive(test::heartbeat({peer(who), writer}, first, first), kHost, at) != Fault::kNone) continue;
    std::int64_t& low_mark = low_marks.try_emplace({who, writer}, 1).first->second;
    counted += std::max<std::int64_t>(0, first - low_mark);
    low_mark = std::max(low_mark, first);
  }
  const double participants = 128 + 16 * 60, own = participants * (1024 + 64 * 60);
  EXPECT_LT(static_cast<double>(counted), 100'000 + 1000 * 60 + static_cast<double>(Guard::kMaxStep) + own);
}

TEST_F(Counting, HidesThoseOfWhoHasLeft) {
  ASSERT_EQ(begins(2), Fault::kNone);
  EXPECT_EQ(last[kHeaderBytes], static_cast<int>(SubmessageId::kHeartbeat));
  ASSERT_EQ(receive(test::departure(peer(1))), Fault::kNone);
  ASSERT_EQ(begins(2), Fault::kNone);
  EXPECT_EQ(last[kHeaderBytes], static_cast<int>(SubmessageId::kPad)) << "Fast DDS may know it still";
  EXPECT_EQ(check_message(last, {false}, *facts), Fault::kNone);
}

// Fast DDS forgets a participant that is silent for its lease, and counts from the start when it returns.
TEST_F(Counting, CountsAnewForWhoWasSilentForItsLease) {
  ASSERT_EQ(begins(1'000'000), Fault::kNone);
  ASSERT_EQ(receive(test::announcement(peer(1)), kHost, 15 * kSecond), Fault::kNone);
  EXPECT_EQ(begins(1'000'000, kUserWriter, 30 * kSecond), Fault::kNone) << "the lease is of 20 s";
  EXPECT_EQ(begins(1'000'000, kUserWriter, 50 * kSecond), Fault::kCounting);
}

// What is refused is no sign of life for Fast DDS.
TEST_F(Counting, WhatIsRefusedKeepsNoLease) {
  ASSERT_EQ(begins(1'000'000), Fault::kNone);
  for (int second = 2; second < 40; ++second)
    ASSERT_EQ(begins(std::int64_t{1} << 62, kUserWriter, second * kSecond), Fault::kCounting);
  EXPECT_EQ(begins(1'000'000, kUserWriter, 40 * kSecond), Fault::kCounting);
}

}  // namespace
}  // namespace phantom::wire
