#include "common/camera/lens.hpp"

#include <gtest/gtest.h>

#include "common/camera/tests/synthetic_camera.hpp"

namespace phantom::camera {
namespace {

using test::wide_lens;

TEST(LensOfACamera, ProjectsByBrownsEquationsToTheLastDigit) {
  const LensModel lens(wide_lens());
  for (double x = -0.5; x <= 0.5; x += 0.1)
    for (double y = -0.4; y <= 0.4; y += 0.1) {
      const Eigen::Vector3d p(x * 1.7, y * 1.7, 1.7);
      ASSERT_TRUE(lens.project(p));
      EXPECT_LT((*lens.project(p) - test::project_by_hand(wide_lens(), p)).norm(), 1e-9);
    }
}

TEST(LensOfACamera, WhatEveryPixelSeesIsProjectedBackToIt) {
  const LensModel lens(wide_lens());
  for (int v = 0; v < 480; v += 7)
    for (int u = 0; u < 640; u += 7) {
      const auto n = lens.direction({u, v});
      ASSERT_TRUE(n) << u << ' ' << v;
      const auto pixel = lens.project(3.0 * n->homogeneous());
      ASSERT_TRUE(pixel);
      EXPECT_LT((*pixel - Eigen::Vector2d(u, v)).norm(), 1e-6);
    }
}

TEST(LensOfACamera, ItsJacobianIsThatOfFiniteDifferences) {
  const LensModel lens(wide_lens());
  constexpr double kStep_m = 1e-6;
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(0.3, -0.2, 0.9), Eigen::Vector3d(-0.1, 0.25, 0.6), Eigen::Vector3d(0.0, 0.0, 2.0)}) {
    const auto J = lens.jacobian(p);
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d step = kStep_m * Eigen::Vector3d::Unit(axis);
      const Eigen::Vector2d slope = (*lens.project(p + step) - *lens.project(p - step)) / (2 * kStep_m);
      EXPECT_LT((J.col(axis) - slope).norm(), 1e-4 * (1 + slope.norm())) << axis;
    }
  }
}

TEST(LensOfACamera, PointsBehindItOrBeyondTheFoldAreNotSeen) {
  const LensModel lens(wide_lens());
  EXPECT_FALSE(lens.project({0.1, 0.1, 0.0}));
  EXPECT_FALSE(lens.project({0.1, 0.1, -1.0}));
  // r (1 − 0.4 r²) grows up to r = √(1 / 1.2).
  Lens folding = wide_lens();
  folding.k1 = -0.4;
  folding.k2 = folding.k3 = folding.p1 = folding.p2 = 0.0;
  const LensModel fold(folding);
  EXPECT_NEAR(fold.largest_radius(), std::sqrt(1 / 1.2), 2e-3);
  EXPECT_TRUE(fold.project({0.9, 0.0, 1.0}));
  EXPECT_FALSE(fold.project({0.93, 0.0, 1.0})) << "it would be imaged where a nearer direction is";
  EXPECT_FALSE(fold.direction({folding.cx_px + folding.fx_px * 0.7, folding.cy_px}))
      << "beyond the image circle";
}

TEST(LensOfACamera, WhatMakesNoSenseIsNamed) {
  EXPECT_EQ(fault_of(wide_lens()), "");
  Lens lens = wide_lens();
  lens.fx_px = -1;
  EXPECT_EQ(fault_of(lens), "its focal lengths must be positive");
  lens = wide_lens();
  lens.cx_px = 700;
  EXPECT_EQ(fault_of(lens), "its principal point lies outside of the picture");
  lens = wide_lens();
  lens.k1 = -1.5;
  EXPECT_NE(fault_of(lens).find("folds back"), std::string::npos);
}

TEST(LensOfACamera, StraightenedItJustContainsTheMiddlesOfTheBorders) {
  const LensModel lens(wide_lens());
  const Lens straight = straightened(lens, 1280, 720);
  const LensModel pinhole(straight);
  int at_border = 0;
  for (const Eigen::Vector2d& middle : {Eigen::Vector2d(-0.5, 239.5), Eigen::Vector2d(639.5, 239.5),
                                        Eigen::Vector2d(319.5, -0.5), Eigen::Vector2d(319.5, 479.5)}) {
    const Eigen::Vector2d pixel = *pinhole.project(lens.direction(middle)->homogeneous());
    EXPECT_GT(pixel.x(), -0.5 - 1e-6);
    EXPECT_LT(pixel.x(), 1279.5 + 1e-6);
    EXPECT_GT(pixel.y(), -0.5 - 1e-6);
    EXPECT_LT(pixel.y(), 719.5 + 1e-6);
    at_border += std::abs(std::abs(pixel.y() - 359.5) - 360) < 1e-6 ||
                 std::abs(std::abs(pixel.x() - 639.5) - 640) < 1e-6;
  }
  EXPECT_GE(at_border, 1);
}

}  // namespace
}  // namespace phantom::camera
