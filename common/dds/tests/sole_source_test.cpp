#include "common/dds/arbitration/sole_source.hpp"

#include <gtest/gtest.h>

#include "common/dds/arbitration/followed_source.hpp"

namespace phantom::dds {
namespace {

constexpr core::Nanoseconds kMs = core::kNsPerMillisecond;

msg::Stamp made_by(std::uint64_t session, std::uint64_t number) {
  msg::Stamp stamp;
  stamp.session(session);
  stamp.sequence_number(number);
  return stamp;
}

TEST(SoleSource, OneProcessIsFollowedAndASecondBesideItIsReported) {
  SoleSource source;
  EXPECT_TRUE(source.accept(made_by(1, 1), 1000 * kMs));
  EXPECT_FALSE(source.accept(made_by(1, 1), 1001 * kMs)) << "it came twice";
  EXPECT_FALSE(source.accept(made_by(2, 7), 1002 * kMs));
  EXPECT_FALSE(source.has_second(1003 * kMs)) << "it may be a successor";
  EXPECT_TRUE(source.accept(made_by(1, 4), 1004 * kMs));
  EXPECT_TRUE(source.has_second(1005 * kMs)) << "the first is there, too";
  EXPECT_FALSE(source.has_second(1004 * kMs + SoleSource::kSecond_ns));
  EXPECT_EQ(source.lost(), 2U);
}

TEST(SoleSource, ASuccessorIsFollowedAndNotReported) {
  SoleSource source;
  EXPECT_TRUE(source.accept(made_by(1, 1), 1000 * kMs));
  EXPECT_FALSE(source.accept(made_by(2, 1), 1200 * kMs));
  const core::Nanoseconds after = 1000 * kMs + SourceGuard::kHold_ns;
  EXPECT_TRUE(source.accept(made_by(2, 2), after));
  EXPECT_TRUE(source.accept(made_by(2, 3), after + kMs));
  EXPECT_FALSE(source.has_second(after + 2 * kMs));
}

TEST(FollowedSource, AnotherIsARivalOnlyWhileTheFollowedOneIsThere) {
  FollowedSource followed;
  EXPECT_FALSE(followed.is_rival(made_by(2, 1), 1000 * kMs)) << "nobody is followed yet";
  followed.heard(made_by(1, 1), 1000 * kMs);
  EXPECT_FALSE(followed.is_rival(made_by(1, 2), 1001 * kMs));
  EXPECT_TRUE(followed.is_rival(made_by(2, 1), 1000 * kMs + FollowedSource::kThere_ns - 1));
  EXPECT_FALSE(followed.is_rival(made_by(2, 1), 1000 * kMs + FollowedSource::kThere_ns));
}

}  // namespace
}  // namespace phantom::dds
