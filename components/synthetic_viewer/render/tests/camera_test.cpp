#include "components/synthetic_viewer/render/camera.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "components/synthetic_viewer/render/tests/project.hpp"

namespace phantom::synthetic_viewer {
namespace {

TEST(Camera, LooksAtItsTargetInTheMiddleOfThePicture) {
  const Camera camera{{2, -3, 4}, {0.5, 0.25, 1}, 0.7, 0.02, 20};
  const auto pixel = project(camera, 1280, 720, camera.target_m);
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 640, 1e-9);
  EXPECT_NEAR(pixel->y(), 360, 1e-9);
}

// A point 1 m in front, off the axis: pinhole geometry by hand.
TEST(Camera, ProjectsAsAPinholeDoes) {
  const double fov = 2 * std::atan(0.5);  // half the picture's height is seen at 0.5 m on 1 m
  const Camera camera{{0, 0, 0}, {0, 1, 0}, fov, 0.02, 20};
  const auto pixel = project(camera, 400, 200, {0.25, 1.0, 0.1});
  ASSERT_TRUE(pixel);
  EXPECT_NEAR(pixel->x(), 200 + 100 * 0.25 / 0.5, 1e-9);  // x of W is to the right when looking along y
  EXPECT_NEAR(pixel->y(), 100 - 100 * 0.1 / 0.5, 1e-9);
}

TEST(Camera, LeavesOutWhatIsBehindIt) {
  const Camera camera{{0, 0, 0}, {0, 1, 0}, 0.7, 0.02, 20};
  EXPECT_FALSE(project(camera, 400, 200, {0, -1, 0}));
  EXPECT_FALSE(project(camera, 400, 200, {0, 0, 0}));
}

TEST(Camera, LookingDownHasNorthAtTheTop) {
  const Camera camera{{0, 0, 2}, {0, 0, 0}, 0.7, 0.02, 20};
  const auto north = project(camera, 200, 200, {0, 0.1, 0});
  const auto east = project(camera, 200, 200, {0.1, 0, 0});
  ASSERT_TRUE(north && east);
  EXPECT_LT(north->y(), 100);
  EXPECT_NEAR(north->x(), 100, 1e-9);
  EXPECT_GT(east->x(), 100);
}

class FrameBox : public ::testing::TestWithParam<std::pair<double, double>> {};

TEST_P(FrameBox, ShowsAllCornersAndTouchesTheBorder) {
  const auto [azimuth, elevation] = GetParam();
  const Eigen::Vector3d low(-1.1, -1.1, 0), high(1.1, 1.1, 1.6);
  const Camera camera = frame_box(low, high, azimuth, elevation, 0.6, 16.0 / 9);
  double nearest_px = 1e9;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d p((corner & 1 ? high : low).x(), (corner & 2 ? high : low).y(),
                            (corner & 4 ? high : low).z());
    const auto pixel = project(camera, 1280, 720, p);
    ASSERT_TRUE(pixel);
    const double border = std::min({pixel->x(), 1280 - pixel->x(), pixel->y(), 720 - pixel->y()});
    EXPECT_GE(border, -1e-6);
    nearest_px = std::min(nearest_px, border);
    EXPECT_GT((p - camera.eye_m).norm(), camera.near_m);
    EXPECT_LT((p - camera.eye_m).norm(), camera.far_m);
  }
  EXPECT_NEAR(nearest_px, 0, 1e-6);
}

INSTANTIATE_TEST_SUITE_P(Directions, FrameBox,
                         ::testing::Values(std::pair{0.0, 0.3}, std::pair{-0.9, 0.45}, std::pair{2.0, 1.2},
                                           std::pair{3.0, -0.4}, std::pair{0.4, std::numbers::pi / 2}));

}  // namespace
}  // namespace phantom::synthetic_viewer
