#include "common/dds/endpoints/stamp.hpp"

#include <gtest/gtest.h>

namespace phantom::dds {
namespace {

msg::Stamp numbered(std::uint64_t session, std::uint64_t number) {
  msg::Stamp out;
  out.session(session);
  out.sequence_number(number);
  return out;
}

TEST(SequenceGuard, RefusesOldRepeatedAndUnnumberedSamples) {
  SequenceGuard guard;
  EXPECT_FALSE(guard.accept(numbered(1, 0))) << "0 is the invalid number";
  EXPECT_TRUE(guard.accept(numbered(1, 5)));
  EXPECT_FALSE(guard.accept(numbered(1, 5)));
  EXPECT_FALSE(guard.accept(numbered(1, 4)));
  EXPECT_TRUE(guard.accept(numbered(1, 8)));
  EXPECT_EQ(guard.lost(), 2u);
}

TEST(SequenceGuard, AcceptsARestartedWriterFromItsFirstSample) {
  SequenceGuard guard;
  EXPECT_TRUE(guard.accept(numbered(1, 1000)));
  EXPECT_TRUE(guard.accept(numbered(2, 1)));
  EXPECT_FALSE(guard.accept(numbered(2, 1)));
  EXPECT_EQ(guard.lost(), 0u);
}

TEST(SequenceGuard, NoNumberLocksItForEver) {
  for (const std::uint64_t wrong : {UINT64_MAX, UINT64_MAX - 1, std::uint64_t{1} << 40}) {
    for (const std::uint64_t session : {std::uint64_t{1}, UINT64_MAX}) {
      SequenceGuard guard;
      ASSERT_TRUE(guard.accept(numbered(session, 5)));
      EXPECT_FALSE(guard.accept(numbered(session, wrong))) << "no writer leaps so far";
      EXPECT_TRUE(guard.accept(numbered(session, 6))) << "who was there goes on";
      EXPECT_EQ(guard.lost(), 0u);

      SequenceGuard begun_wrong;
      ASSERT_TRUE(begun_wrong.accept(numbered(session, wrong)));
      for (std::uint64_t n = 1; n < SequenceGuard::kRun; ++n)
        ASSERT_FALSE(begun_wrong.accept(numbered(session, n)));
      EXPECT_TRUE(begun_wrong.accept(numbered(session, SequenceGuard::kRun))) << "who counts on is believed";
      EXPECT_TRUE(begun_wrong.accept(numbered(session, SequenceGuard::kRun + 1)));
    }
  }
}

TEST(SequenceGuard, SamplesThatComeTwiceAreNeverBelieved) {
  SequenceGuard guard;
  for (std::uint64_t n = 100; n < 1000; ++n) {
    ASSERT_TRUE(guard.accept(numbered(1, n)));
    ASSERT_FALSE(guard.accept(numbered(1, n - 50))) << "by a second way, later";
  }
  for (int again = 0; again < 1000; ++again) ASSERT_FALSE(guard.accept(numbered(1, 999)));
}

TEST(Echo, ReturnsWhatItsWriterStamped) {
  msg::Stamp given = numbered(9, 77);
  given.monotonic_ns(123456789);
  const msg::Echo echo = echo_of(id_of(given));
  EXPECT_EQ(echo.session(), 9u);
  EXPECT_EQ(echo.sequence_number(), 77u);
  EXPECT_EQ(echo.monotonic_ns(), 123456789);
  EXPECT_EQ(echo_of(id_of(echo)), echo);
}

TEST(Echo, NamesWhenOurSampleWasMadeOnlyIfItCan) {
  msg::Stamp given = numbered(9, 77);
  given.monotonic_ns(5000);
  EXPECT_EQ(core::answered_ns(id_of(echo_of(id_of(given))), 9, 6000), 5000);
  EXPECT_EQ(core::answered_ns(id_of(echo_of(id_of(given))), 9, 5000), 5000);
  EXPECT_EQ(core::answered_ns(id_of(echo_of(id_of(given))), 9, 4999), 0) << "made after it was answered";
  EXPECT_EQ(core::answered_ns(id_of(echo_of(id_of(given))), 8, 6000), 0) << "another process's";
  given.monotonic_ns(INT64_MIN);
  EXPECT_EQ(core::answered_ns(id_of(echo_of(id_of(given))), 9, 6000), 0);
  EXPECT_EQ(core::answered_ns(id_of(msg::Echo()), 0, 6000), 0) << "none";
}

}  // namespace
}  // namespace phantom::dds
