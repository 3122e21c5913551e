#include "components/synthetic_viewer/output/frame_pace.hpp"

#include <gtest/gtest.h>

namespace phantom::synthetic_viewer {
namespace {

using core::kNsPerMillisecond;
using core::kNsPerSecond;

constexpr core::Nanoseconds kBegin = 123 * kNsPerSecond;

TEST(FramePace, WritesAFrameAtOnceAndThenOneEachPeriod) {
  FramePace pace(10.0);
  EXPECT_EQ(pace.due(kBegin), 1);
  EXPECT_EQ(pace.due(kBegin), 0);
  EXPECT_EQ(pace.due(kBegin + 99 * kNsPerMillisecond), 0);
  EXPECT_EQ(pace.due(kBegin + 101 * kNsPerMillisecond), 1);
  EXPECT_EQ(pace.due(kBegin + 201 * kNsPerMillisecond), 1);
}

TEST(FramePace, KeepsTimeHoweverOftenItIsAsked) {
  for (const core::Nanoseconds step :
       {1 * kNsPerMillisecond, 7 * kNsPerMillisecond, 333 * kNsPerMillisecond, 1900 * kNsPerMillisecond}) {
    FramePace pace(25.0);
    core::Nanoseconds now = kBegin;
    int frames = pace.due(now);
    for (; now < kBegin + 60 * kNsPerSecond; frames += pace.due(now)) now += step;
    EXPECT_NEAR(frames, 1 + 25.0 * core::seconds(now - kBegin), 1.0) << "asked every " << step << " ns";
  }
}

TEST(FramePace, GivesUpWhatIsOwedAfterALongPause) {
  FramePace pace(20.0);
  EXPECT_EQ(pace.due(kBegin), 1);
  const core::Nanoseconds later = kBegin + 10 * kNsPerSecond;
  EXPECT_EQ(pace.due(later), 1) << "the picture of now is shown, the pause is not";
  EXPECT_EQ(pace.due(later + 101 * kNsPerMillisecond), 2) << "and time goes on from there";
  EXPECT_EQ(pace.due(later + kNsPerSecond + 51 * kNsPerMillisecond), 19);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
