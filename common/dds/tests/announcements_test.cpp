#include "common/dds/arbitration/announcements.hpp"

#include <gtest/gtest.h>

#include "common/dds/tests/prefixes.hpp"

namespace phantom::dds {
namespace {

constexpr core::Nanoseconds kSecond = core::kNsPerSecond;
constexpr wire::Source kThere{0x0a1e0102, 7410};

wire::ParticipantFact announcement(std::uint8_t number, double lease_s) {
  wire::ParticipantFact fact;
  fact.announced = fact.sender = prefix(number);
  fact.lease_s = lease_s;
  fact.listens = kThere;
  return fact;
}

TEST(Announcements, HoldForTheLease) {
  Announcements announcements;
  announcements.note(announcement(1, 5), kSecond);
  announcements.note(announcement(2, 20), kSecond);
  ASSERT_EQ(announcements.present(6 * kSecond).size(), 2U);
  EXPECT_EQ(announcements.present(6 * kSecond)[0].participant, prefix(1));
  EXPECT_EQ(announcements.present(6 * kSecond)[0].listens, kThere);
  ASSERT_EQ(announcements.present(7 * kSecond).size(), 1U);
  EXPECT_EQ(announcements.present(7 * kSecond)[0].participant, prefix(2));
  announcements.note(announcement(1, 5), 8 * kSecond);
  EXPECT_EQ(announcements.present(9 * kSecond).size(), 2U);
}

TEST(Announcements, EndWithADeparture) {
  Announcements announcements;
  wire::ParticipantFact fact = announcement(1, 5);
  announcements.note(fact, kSecond);
  fact.departs = true;
  announcements.note(fact, 2 * kSecond);
  EXPECT_TRUE(announcements.present(2 * kSecond).empty());
}

TEST(Announcements, StrangersTakeLimitedMemory) {
  Announcements announcements;
  for (int i = 0; i < 3 * static_cast<int>(Announcements::kMax); ++i) {
    wire::ParticipantFact fact = announcement(0, 100);
    fact.announced = {static_cast<std::uint8_t>(i % 256), static_cast<std::uint8_t>(i / 256)};
    announcements.note(fact, kSecond);
  }
  EXPECT_EQ(announcements.present(kSecond).size(), Announcements::kMax);
}

}  // namespace
}  // namespace phantom::dds
