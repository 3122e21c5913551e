#include "common/dds/admission/delay_monitor.hpp"

#include <gtest/gtest.h>

namespace phantom::dds::delay_monitor_test {
namespace {

constexpr core::Nanoseconds kSecond = core::kNsPerSecond, kMs = core::kNsPerMillisecond;

/// A writer's host, whose clocks are apart from this one's.
struct Way {
  core::Nanoseconds monotonic_apart_ns = 7'000 * kSecond, utc_apart_ns = 0;
  std::uint64_t session = 1;
  DelayMonitor monitor;

  /// Whether a sample is late that was sent then and was on its way for so long.
  bool is_late(core::Nanoseconds sent_ns, core::Nanoseconds delay_ns) {
    msg::Stamp stamp;
    stamp.sequence_number(1);
    stamp.session(session);
    stamp.monotonic_ns(sent_ns + monotonic_apart_ns);
    stamp.utc_ns(sent_ns + utc_apart_ns);
    return monitor.is_late(stamp, sent_ns + delay_ns, sent_ns + delay_ns);
  }
};

// Tries slave_io: a `master_state` that was held up
TEST(DelayMonitor, SR07_WhatAFrozenReaderFindsInItsBufferIsLateButForItsEnd) {
  for (const core::Nanoseconds apart : {-100 * kSecond + 1, core::Nanoseconds{0}, 100'000 * kSecond}) {
    Way way;
    way.monotonic_apart_ns = apart;
    for (int i = 200'000; i < 201'000; ++i) ASSERT_FALSE(way.is_late(i * kMs, kMs));
    for (int i = 201'000; i < 204'000; ++i) {  // it stands still until 204 s and reads all at once
      const int delay_ms = 204'000 - i;
      const bool late = way.is_late(i * kMs, delay_ms * kMs);
      if (delay_ms <= 1000 || delay_ms > 1010) {  // between: the drift
        EXPECT_EQ(late, delay_ms > 1010) << i;
      }
    }
    EXPECT_FALSE(way.is_late(204'001 * kMs, kMs));
  }
}

// Tries slave_io: a `master_state` that was held up
TEST(DelayMonitor, SR07_ANetworksQueueIsLateForAsLongAsItLasts) {
  Way way;
  ASSERT_FALSE(way.is_late(kSecond, kMs));
  for (int i = 2; i < 28; ++i) EXPECT_TRUE(way.is_late(i * kSecond, 3 * kSecond)) << i;
  EXPECT_FALSE(way.is_late(31 * kSecond, kMs));
}

// A suspended host's monotonic clock stands still meanwhile.
TEST(DelayMonitor, AWaySlowForHalfAMinuteIsBelieved) {
  Way way;
  ASSERT_FALSE(way.is_late(kSecond, kMs));
  way.monotonic_apart_ns -= 60 * kSecond;
  EXPECT_TRUE(way.is_late(61 * kSecond - 40 * kSecond, kMs));
  EXPECT_FALSE(way.is_late(62 * kSecond, kMs));
  EXPECT_FALSE(way.is_late(63 * kSecond, kMs));
}

TEST(DelayMonitor, ClocksThatDriftMakeNothingLate) {
  Way way;
  for (int s = 1; s < 100'000; s += 10) {
    way.monotonic_apart_ns -= 10 * 500'000;  // by 500 millionths
    ASSERT_FALSE(way.is_late(s * kSecond, kMs)) << s;
  }
}

TEST(DelayMonitor, NoSingleStampMakesAllThatFollowLate) {
  Way way;
  ASSERT_FALSE(way.is_late(kSecond, kMs));
  EXPECT_TRUE(way.is_late(2 * kSecond, -1000 * kSecond)) << "out of the future";
  EXPECT_FALSE(way.is_late(3 * kSecond, kMs));
  for (int i = 1; i < DelayMonitor::kRun; ++i) EXPECT_TRUE(way.is_late((3 + i) * kSecond, -1000 * kSecond));
  EXPECT_FALSE(way.is_late(20 * kSecond, -1000 * kSecond)) << "its clock runs otherwise";
}

TEST(DelayMonitor, ARestartedWriterAndAStampWithoutATimeAreNotLate) {
  Way way;
  ASSERT_FALSE(way.is_late(kSecond, kMs));
  way.session = 2;
  way.monotonic_apart_ns = 5;  // its host was started again
  EXPECT_FALSE(way.is_late(100 * kSecond, kMs));
  way.monotonic_apart_ns = -101 * kSecond;
  EXPECT_FALSE(way.is_late(101 * kSecond, 9 * kSecond));
}

TEST(DelayMonitor, WallClocksDecideNothingAndAreMeasured) {
  Way way;
  EXPECT_FALSE(way.monitor.clock_difference_s());
  constexpr core::Nanoseconds kTwentyYears = 630'000'000 * kSecond;
  int at_s = 1;
  for (const core::Nanoseconds apart : {-5 * kSecond, 5 * kSecond, kTwentyYears, -kTwentyYears}) {
    way.utc_apart_ns = apart;
    ASSERT_FALSE(way.is_late(at_s++ * kSecond, kMs));
    EXPECT_NEAR(*way.monitor.clock_difference_s(), -core::seconds(apart), 0.0011);
  }
  ASSERT_FALSE(way.is_late(at_s * kSecond, 900 * kMs)) << "slow, and measures nothing";
  EXPECT_NEAR(*way.monitor.clock_difference_s(), core::seconds(kTwentyYears), 0.0011);
}

}  // namespace
}  // namespace phantom::dds::delay_monitor_test
