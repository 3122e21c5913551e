#include "components/workspace_camera/camera_watch.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace phantom::workspace_camera::camera_watch_test {
namespace {

using enum messages::DepthCameraState;
constexpr core::Nanoseconds kMs = core::kNsPerMillisecond, kStart = 1000 * kMs;

std::vector<std::uint16_t> image(std::uint16_t first) { return {first, 2, 3, 4}; }

TEST(CameraWatch, ACameraIsWaitedForThenLiveThenLateThenDead) {
  CameraWatch watch("above", 0.2, 0.4);
  EXPECT_EQ(watch.state(kStart), kWaiting);
  EXPECT_TRUE(watch.put(kStart, image(1)));
  EXPECT_EQ(watch.state(kStart + 200 * kMs), kLive);
  EXPECT_EQ(watch.state(kStart + 201 * kMs), kLate);
  EXPECT_EQ(watch.state(kStart + 401 * kMs), kDead);
  EXPECT_TRUE(watch.put(kStart + 500 * kMs, image(2)));
  EXPECT_EQ(watch.state(kStart + 501 * kMs), kLive);
}

TEST(CameraWatch, AFileMayRepeatAnImage) {
  CameraWatch watch("recording", 0.2, 0.4);
  EXPECT_TRUE(watch.put(kStart, image(1), true));
  EXPECT_TRUE(watch.put(kStart + 300 * kMs, image(1), true));
  EXPECT_EQ(watch.state(kStart + 400 * kMs), kLive);
}

// Tries workspace_camera: a camera repeats one image
TEST(CameraWatch, TheSameImageAgainAndAgainIsThatOfADeadCamera) {
  CameraWatch watch("above", 0.2, 0.4);
  EXPECT_TRUE(watch.put(kStart, image(1)));
  for (int i = 1; i <= 50; ++i) EXPECT_FALSE(watch.put(kStart + i * 10 * kMs, image(1)));
  EXPECT_EQ(watch.state(kStart + 500 * kMs), kDead);
  EXPECT_TRUE(watch.put(kStart + 510 * kMs, image(2)));
  EXPECT_EQ(watch.state(kStart + 511 * kMs), kLive);
}

TEST(CameraWatch, TellsAgeAndRate) {
  CameraWatch watch("above", 0.2, 0.4);
  EXPECT_EQ(watch.health(kStart), (messages::DepthCameraHealth{"above", kWaiting, 0.0, 0.0}));
  for (int i = 0; i < 20; ++i) {
    EXPECT_TRUE(watch.put(kStart + i * 100 * kMs, image(static_cast<std::uint16_t>(i))));
    watch.fused(kStart + i * 100 * kMs);
  }
  const auto health = watch.health(kStart + 1950 * kMs);
  EXPECT_EQ(health.state, kLive);
  EXPECT_NEAR(health.age_s, 0.05, 1e-9);
  EXPECT_EQ(health.rate_hz, 10.0);
}

}  // namespace
}  // namespace phantom::workspace_camera::camera_watch_test
