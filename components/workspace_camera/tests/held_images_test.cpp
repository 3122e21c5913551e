#include "components/workspace_camera/held_images.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace phantom::workspace_camera::held_images_test {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::Pair;
constexpr core::Nanoseconds kMs = core::kNsPerMillisecond, kHold = 60 * kMs;

ArrivedImage image(std::size_t camera, core::Nanoseconds exposed_ns, core::Nanoseconds received_ns) {
  ArrivedImage made;
  made.camera = camera;
  made.exposed_ns = exposed_ns;
  made.received_ns = received_ns;
  return made;
}

/// Camera and exposure of each image that waits no longer.
std::vector<std::pair<std::size_t, core::Nanoseconds>> released(HeldImages& held, core::Nanoseconds known_ns,
                                                                core::Nanoseconds now_ns) {
  std::vector<std::pair<std::size_t, core::Nanoseconds>> all;
  held.release(known_ns, now_ns,
               [&](const ArrivedImage& one) { all.emplace_back(one.camera, one.exposed_ns / kMs); });
  return all;
}

TEST(HeldImages, WaitUntilTheArmsStatesOfTheirTimeAreKnown) {
  HeldImages held(1, kHold);
  EXPECT_FALSE(held.any());
  held.hold(image(0, 100 * kMs, 110 * kMs));
  EXPECT_TRUE(held.any());
  EXPECT_THAT(released(held, 99 * kMs, 111 * kMs), IsEmpty());
  EXPECT_THAT(released(held, 100 * kMs, 112 * kMs), ElementsAre(Pair(0, 100)));
  EXPECT_FALSE(held.any());
  EXPECT_THAT(released(held, 200 * kMs, 113 * kMs), IsEmpty()) << "each once";
}

TEST(HeldImages, OfOneCameraTheNewestCountsAndAnotherCamerasIsKept) {
  HeldImages held(2, kHold);
  held.hold(image(0, 100 * kMs, 101 * kMs));
  held.hold(image(1, 105 * kMs, 106 * kMs));
  held.hold(image(1, 130 * kMs, 131 * kMs));
  EXPECT_THAT(released(held, 130 * kMs, 132 * kMs), ElementsAre(Pair(0, 100), Pair(1, 130)));
}

/// Without an arm that is heard a camera's images come nevertheless, however often new ones come.
TEST(HeldImages, WaitNoLongerThanTheirHold) {
  HeldImages held(1, kHold);
  core::Nanoseconds waited_ns = 0;
  for (core::Nanoseconds now_ns = 0; now_ns < 300 * kMs; now_ns += 10 * kMs) {
    held.hold(image(0, now_ns - kMs, now_ns));
    const auto images = released(held, -1000 * kMs, now_ns);
    waited_ns = images.empty() ? waited_ns + 10 * kMs : 0;
    EXPECT_LE(waited_ns, kHold);
  }
  EXPECT_THAT(released(held, std::numeric_limits<core::Nanoseconds>::max(), 301 * kMs),
              ElementsAre(Pair(0, 289)))
      << "without an arm none waits";
}

}  // namespace
}  // namespace phantom::workspace_camera::held_images_test
