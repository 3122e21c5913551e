#include "common/dds/admission/handshake_watch.hpp"

#include <gtest/gtest.h>

#include <set>

#include "common/dds/tests/prefixes.hpp"

namespace phantom::dds {
namespace {

const GuidPrefix kSelf = prefix(5), kGreater = prefix(9), kSmaller = prefix(2);

TEST(HandshakeWatch, IsPatientWithAHandshakeThatSucceeds) {
  HandshakeWatch watch;
  watch.discovered(kGreater, 100 * kS);
  EXPECT_TRUE(watch.overdue(kSelf, 100 * kS + HandshakeWatch::kPatience - 1).empty());
  EXPECT_EQ(watch.admitted(kGreater), 0);
  EXPECT_TRUE(watch.overdue(kSelf, 1000 * kS).empty());
}

TEST(HandshakeWatch, NobodyIsAskedAnythingWhileAlone) {
  HandshakeWatch watch;
  EXPECT_TRUE(watch.overdue(kSelf, 0).empty());
  EXPECT_TRUE(watch.overdue(kSelf, 100000 * kS).empty());
}

TEST(HandshakeWatch, WhoLeftIsLetGo) {
  HandshakeWatch watch;
  watch.discovered(kGreater, 0);
  EXPECT_TRUE(watch.left(kGreater, 0));
  EXPECT_TRUE(watch.overdue(kSelf, 1000 * kS).empty());
  EXPECT_TRUE(watch.left(kSmaller, 0));  // never seen
}

// The thread that drops a peer and the one that discovers it anew tell of it in any order.
TEST(HandshakeWatch, AnEndThatIsToldLateDoesNotEndTheWatch) {
  HandshakeWatch watch;
  watch.discovered(kGreater, 0);
  EXPECT_EQ(watch.admitted(kGreater), 0);
  watch.discovered(kGreater, 20 * kS);
  EXPECT_FALSE(watch.left(kGreater, 20 * kS));
  EXPECT_EQ(watch.overdue(kSelf, 30 * kS).size(), 1u);
  EXPECT_TRUE(watch.left(kGreater, 31 * kS));
  EXPECT_TRUE(watch.overdue(kSelf, 1000 * kS).empty());
}

TEST(HandshakeWatch, WhoHasTheSmallerGuidBeginsFirst) {
  HandshakeWatch watch;
  watch.discovered(kGreater, 0);
  watch.discovered(kSmaller, 0);
  const auto first = watch.overdue(kSelf, HandshakeWatch::kPatience);
  ASSERT_EQ(first.size(), 1u);
  EXPECT_EQ(first[0].peer, kGreater);
  const auto second = watch.overdue(kSelf, HandshakeWatch::kPatienceOfGreater);
  ASSERT_EQ(second.size(), 1u);
  EXPECT_EQ(second[0].peer, kSmaller);
  EXPECT_LT(HandshakeWatch::kPatience, HandshakeWatch::kPatienceOfGreater);
}

TEST(HandshakeWatch, AStrangerIsAskedEverMoreSeldom) {
  HandshakeWatch watch;
  watch.discovered(kGreater, 0);
  std::vector<core::Nanoseconds> at;
  for (core::Nanoseconds now = 0; now <= 300 * kS; now += kS) {
    for (const auto& attempt : watch.overdue(kSelf, now)) {
      at.push_back(now / kS);
      EXPECT_EQ(attempt.number, static_cast<int>(at.size()));
      EXPECT_EQ(attempt.waited_ns, now);
    }
  }
  EXPECT_EQ(at, (std::vector<core::Nanoseconds>{10, 30, 70, 130, 190, 250}));
}

TEST(HandshakeWatch, StaysSeldomForDays) {
  HandshakeWatch watch;
  watch.discovered(kGreater, 0);
  core::Nanoseconds last = 0;
  for (core::Nanoseconds now = 0; now < 2 * 86400 * kS; now += 10 * kS) {
    if (watch.overdue(kSelf, now).empty()) continue;
    EXPECT_LE(now - last, HandshakeWatch::kMaxPatience);
    if (now > 130 * kS) {
      EXPECT_EQ(now - last, HandshakeWatch::kMaxPatience);
    }
    last = now;
  }
  EXPECT_GT(last, (2 * 86400 - 70) * kS);
}

TEST(HandshakeWatch, CountsTheAttemptsUntilAdmission) {
  HandshakeWatch watch;
  watch.discovered(kGreater, 0);
  EXPECT_EQ(watch.overdue(kSelf, 10 * kS).size(), 1u);
  EXPECT_EQ(watch.overdue(kSelf, 30 * kS).size(), 1u);
  EXPECT_EQ(watch.admitted(kGreater), 2);
  EXPECT_EQ(watch.admitted(kGreater), 0);
}

TEST(HandshakeWatch, DiscoveredAnewItIsGivenTimeAnew) {
  HandshakeWatch watch;
  watch.discovered(kGreater, 0);
  watch.left(kGreater, 8 * kS);
  watch.discovered(kGreater, 9 * kS);
  EXPECT_TRUE(watch.overdue(kSelf, 18 * kS).empty());
  EXPECT_EQ(watch.overdue(kSelf, 19 * kS).size(), 1u);
}

// Two that take leave of each other in turns make each other leave and return: their patience grows all the
// same, until the slowest handshake has its time.
TEST(HandshakeWatch, WhoLeavesAndReturnsMeetsAsMuchPatienceAsBefore) {
  HandshakeWatch watch;
  watch.discovered(kGreater, 0);
  EXPECT_EQ(watch.overdue(kSelf, 10 * kS).size(), 1u);
  EXPECT_TRUE(watch.left(kGreater, 15 * kS));
  watch.discovered(kGreater, 16 * kS);
  EXPECT_TRUE(watch.overdue(kSelf, 35 * kS).empty());
  const auto second = watch.overdue(kSelf, 36 * kS);
  ASSERT_EQ(second.size(), 1u);
  EXPECT_EQ(second[0].number, 2);
  EXPECT_EQ(second[0].waited_ns, 20 * kS);
  // Admitted, or long away, it is new again.
  EXPECT_EQ(watch.admitted(kGreater), 2);
  EXPECT_TRUE(watch.left(kGreater, 40 * kS));
  watch.discovered(kGreater, 41 * kS);
  EXPECT_EQ(watch.overdue(kSelf, 51 * kS).size(), 1u);
  EXPECT_TRUE(watch.left(kGreater, 60 * kS));
  EXPECT_TRUE(watch.overdue(kSelf, 121 * kS).empty());
  watch.discovered(kGreater, 122 * kS);
  EXPECT_EQ(watch.overdue(kSelf, 132 * kS).size(), 1u);
}

TEST(HandshakeWatch, ACrowdOfStrangersIsServedInTurns) {
  HandshakeWatch watch;
  for (int i = 0; i < 100; ++i) watch.discovered(prefix(static_cast<std::uint8_t>(100 + i)), 0);
  std::set<GuidPrefix> asked;
  for (core::Nanoseconds now = 15 * kS; now < 28 * kS; now += kS) {  // the first ones are due again by then
    const auto due = watch.overdue(kSelf, now);
    EXPECT_LE(due.size(), HandshakeWatch::kMaxAtOnce);
    for (const auto& attempt : due) asked.insert(attempt.peer);
  }
  EXPECT_EQ(asked.size(), 100u);
}

}  // namespace
}  // namespace phantom::dds
