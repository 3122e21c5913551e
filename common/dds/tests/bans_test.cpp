#include "common/dds/admission/bans.hpp"

#include <gtest/gtest.h>

#include "common/dds/tests/prefixes.hpp"

namespace phantom::dds {
namespace {

TEST(Bans, HoldForGoodOrUntilTheyAreLifted) {
  Bans bans;
  EXPECT_FALSE(bans.holds(prefix(1)));
  bans.ban(prefix(1));
  bans.suspend(prefix(2));
  bans.suspend(prefix(2));
  EXPECT_EQ(bans.take_fresh(), (std::vector{prefix(1), prefix(2)}));
  EXPECT_TRUE(bans.take_fresh().empty());
  EXPECT_TRUE(bans.holds(prefix(1)));
  EXPECT_TRUE(bans.holds(prefix(2)));
  EXPECT_FALSE(bans.holds(prefix(3)));
  EXPECT_TRUE(bans.resume());
  EXPECT_FALSE(bans.resume()) << "none are left";
  EXPECT_TRUE(bans.holds(prefix(1)));
  EXPECT_FALSE(bans.holds(prefix(2)));
  bans.suspend(prefix(2));
  EXPECT_EQ(bans.take_fresh(), std::vector{prefix(2)}) << "once more to be forgotten by Fast DDS";
}

TEST(Bans, InventedParticipantsTakeLimitedMemoryAndAreToldAsForgotten) {
  Bans bans;
  for (std::size_t i = 0; i < 2 * Bans::kMax; ++i)
    bans.suspend({static_cast<std::uint8_t>(i % 256), static_cast<std::uint8_t>(i / 256)});
  EXPECT_EQ(bans.forgotten(), Bans::kMax);
  bans.resume();
  EXPECT_EQ(bans.forgotten(), Bans::kMax) << "a count never falls";
}

}  // namespace
}  // namespace phantom::dds
