#include "common/dds/arbitration/discovery_gaps.hpp"

#include <gtest/gtest.h>

#include "common/dds/tests/prefixes.hpp"

namespace phantom::dds {
namespace {

constexpr wire::EntityId kWriters = wire::kPublicationWriter, kReaders = wire::kSubscriptionWriter;

wire::DiscoverySequence says(int peer, std::int64_t first, std::int64_t last, wire::EntityId of = kWriters) {
  return {{prefix(static_cast<std::uint8_t>(peer)), of}, first, last, true};
}
wire::DiscoverySequence comes(int peer, std::int64_t first, std::int64_t last, wire::EntityId of = kWriters) {
  return {{prefix(static_cast<std::uint8_t>(peer)), of}, first, last, false};
}

class DiscoveryGapsTest : public testing::Test {
 protected:
  void at(core::Nanoseconds now, const wire::DiscoverySequence& sequence) { gaps_.note({&sequence, 1}, now); }
  std::size_t incomplete(core::Nanoseconds before) const { return gaps_.incomplete(before).size(); }
  DiscoveryGaps gaps_;
};

TEST_F(DiscoveryGapsTest, WhatIsSaidAndDoesNotComeIsMissingSinceThen) {
  at(5 * kS, says(9, 1, 3));
  EXPECT_EQ(incomplete(5 * kS - 1), 0U);
  at(6 * kS, comes(9, 1, 1));
  at(7 * kS, comes(9, 3, 3));
  at(8 * kS, says(9, 1, 3));
  ASSERT_EQ(incomplete(5 * kS), 1U);
  EXPECT_EQ(gaps_.incomplete(5 * kS)[0].participant, prefix(9));
  EXPECT_EQ(gaps_.incomplete(5 * kS)[0].since, 5 * kS);
  at(9 * kS, comes(9, 2, 2));
  EXPECT_EQ(incomplete(100 * kS), 0U);
}

TEST_F(DiscoveryGapsTest, WhatTheWriterHasNoMoreIsNotMissing) {
  at(5 * kS, says(9, 4, 6));
  at(6 * kS, comes(9, 4, 5));  // a GAP
  at(7 * kS, comes(9, 6, 6));
  EXPECT_EQ(incomplete(100 * kS), 0U);
  at(8 * kS, says(9, 7, 6));  // it has none
  EXPECT_EQ(incomplete(100 * kS), 0U);
}

TEST_F(DiscoveryGapsTest, ReadersAndWritersOfAParticipantCountTogetherAndParticipantsApart) {
  at(5 * kS, says(9, 1, 1));
  at(4 * kS, says(9, 1, 1, kReaders));
  at(6 * kS, says(7, 1, 1));
  ASSERT_EQ(incomplete(100 * kS), 2U);
  EXPECT_EQ(gaps_.incomplete(5 * kS)[0].since, 4 * kS);
  gaps_.forget(prefix(9));
  ASSERT_EQ(incomplete(100 * kS), 1U);
  EXPECT_EQ(gaps_.incomplete(100 * kS)[0].participant, prefix(7));
}

TEST_F(DiscoveryGapsTest, AnyNumbersAreTaken) {
  at(5 * kS, says(9, 1, INT64_MAX));
  at(5 * kS, comes(9, 1, INT64_MAX));
  EXPECT_EQ(incomplete(100 * kS), 0U) << "later samples are not judged";
  at(5 * kS, says(8, INT64_MAX, INT64_MAX));
  at(5 * kS, comes(8, 5, 4));
  EXPECT_EQ(incomplete(100 * kS), 0U);
  for (int peer = 0; peer < 200; ++peer) at(6 * kS, says(peer, 1, 1));
  EXPECT_LE(incomplete(100 * kS), DiscoveryGaps::kMaxWriters);
}

}  // namespace
}  // namespace phantom::dds
