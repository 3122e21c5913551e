#include "common/camera/board.hpp"

#include <gtest/gtest.h>

#include "common/camera/pose_fit.hpp"
#include "common/camera/tests/synthetic_camera.hpp"

namespace phantom::camera {
namespace {

using test::board_before;
using test::wide_lens;

const Board kBoard{9, 6, 0.03};
constexpr double kNoise = 2.0;  // grey levels

std::vector<geometry::Pose> views() {
  return {board_before(kBoard, 0.45, 0.5, 0.1, 0.1), board_before(kBoard, 0.45, -0.5, 0.2, -0.2),
          board_before(kBoard, 0.45, 0.1, 0.6, 0.3), board_before(kBoard, 0.45, -0.1, -0.6, 0.0),
          board_before(kBoard, 0.50, 0.4, 0.4, -0.4, {0.06, 0.04}),
          board_before(kBoard, 0.50, -0.4, 0.3, 0.2, {-0.07, -0.04}),
          board_before(kBoard, 0.42, 0.2, -0.3, 0.0, {0.05, -0.03}),
          board_before(kBoard, 0.42, 0.3, 0.2, 0.5, {-0.05, 0.03}),
          // Into the corners of the picture.
          board_before(kBoard, 0.50, 0.3, 0.2, 0.0, {0.13, 0.10}),
          board_before(kBoard, 0.50, -0.3, 0.2, 0.0, {-0.15, 0.10}),
          board_before(kBoard, 0.50, 0.2, -0.3, 0.0, {-0.15, -0.09}),
          board_before(kBoard, 0.50, -0.2, -0.3, 0.0, {0.13, -0.09})};
}

class PicturedBoard : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const test::BoardRenderer renderer(wide_lens());
    unsigned seed = 1;
    for (const geometry::Pose& X_CB : views()) {
      const auto grey = renderer.render(kBoard, X_CB, kNoise, seed++);
      corners_.push_back(
          find_corners({640, 480, grey.data()}, kBoard).value_or(std::vector<Eigen::Vector2d>()));
    }
  }
  static std::vector<std::vector<Eigen::Vector2d>> corners_;
};
std::vector<std::vector<Eigen::Vector2d>> PicturedBoard::corners_;

TEST_F(PicturedBoard, ItsCornersAreFoundToAFractionOfAPixel) {
  double sum = 0.0;
  int count = 0;
  for (std::size_t k = 0; k < views().size(); ++k) {
    ASSERT_EQ(corners_[k].size(), 54U) << "picture " << k;
    for (int i = 0; i < kBoard.corners(); ++i) {
      const Eigen::Vector2d truth = test::project_by_hand(wide_lens(), views()[k] * kBoard.corner_B_m(i));
      const double off = (corners_[k][static_cast<std::size_t>(i)] - truth).norm();
      EXPECT_LT(off, 0.5) << k << ", corner " << i;
      sum += off * off;
      ++count;
    }
  }
  EXPECT_LT(std::sqrt(sum / count), 0.15);
}

TEST_F(PicturedBoard, TheLensIsRecoveredWithinWhatIsToldOfIt) {
  const auto fit = fit_lens(640, 480, kBoard, corners_);
  ASSERT_TRUE(fit) << fit.status().message();
  EXPECT_LT(fit->rms_px, 0.2);
  EXPECT_GT(fit->reach, 0.7);
  EXPECT_LT(fit->focal_sigma_px, 3.0);
  EXPECT_LT(std::abs(fit->lens.fx_px - wide_lens().fx_px), 4 * fit->focal_sigma_px + 0.5);
  EXPECT_LT(std::abs(fit->lens.fy_px - wide_lens().fy_px), 4 * fit->focal_sigma_px + 0.5);
  EXPECT_LT(std::abs(fit->lens.cx_px - wide_lens().cx_px), 4 * fit->centre_sigma_px + 0.5);
  // What counts is where things are drawn, everywhere that corners were seen.
  const LensModel found(fit->lens), truth(wide_lens());
  for (int v = 30; v < 480; v += 30)
    for (int u = 30; u < 640; u += 30) {
      if ((Eigen::Vector2d(u, v) - Eigen::Vector2d(319.5, 239.5)).norm() > fit->reach * 400) continue;
      const auto n = found.direction({u, v});
      ASSERT_TRUE(n);
      EXPECT_LT((*truth.project(n->homogeneous()) - Eigen::Vector2d(u, v)).norm(),
                4 * fit->centre_sigma_px + 0.5)
          << u << ' ' << v;
    }
}

TEST_F(PicturedBoard, WhatWasNotSeenNearTheCornersIsSaid) {
  const auto fit = fit_lens(640, 480, kBoard, std::span(corners_).first(8));
  ASSERT_TRUE(fit) << fit.status().message();
  EXPECT_LT(fit->reach, 0.85);
  EXPECT_EQ(fit->lens.k3, 0.0);
}

TEST_F(PicturedBoard, WhereItStandsIsKnownToAMillimetreByTheTrueLens) {
  const LensModel lens(wide_lens());
  std::vector<SeenPoint> points;
  for (int i = 0; i < kBoard.corners(); ++i)
    points.push_back({kBoard.corner_B_m(i), corners_[0][static_cast<std::size_t>(i)]});
  const auto fit = fit_pose(lens, points, {.pixel_sigma_px = 0.15});
  ASSERT_TRUE(fit) << fit.status().message();
  const geometry::Pose off = fit->X_WC.inverse() * views()[0].inverse();
  EXPECT_LT(off.translation_m.norm(), 1e-3);
  EXPECT_LT(geometry::rotation_vector(off.rotation).norm(), 2e-3);
}

TEST_F(PicturedBoard, PicturesThatDoNotDetermineALensAreRefusedInWords) {
  const std::vector<std::vector<Eigen::Vector2d>> two(corners_.begin(), corners_.begin() + 2);
  const auto few = fit_lens(640, 480, kBoard, two);
  ASSERT_FALSE(few);
  EXPECT_NE(few.status().message().find("needs three pictures"), std::string::npos);
  // Never tilted: the focal length and the distance cannot be told apart.
  std::vector<std::vector<Eigen::Vector2d>> flat;
  for (unsigned k = 0; k < 4; ++k) {
    std::vector<Eigen::Vector2d> corners;
    for (int i = 0; i < kBoard.corners(); ++i)
      corners.push_back(test::project_by_hand(
          wide_lens(), board_before(kBoard, 0.6 + 0.1 * k, 0, 0, 0.1 * k) * kBoard.corner_B_m(i)));
    for (std::size_t i = 0; i < corners.size(); ++i)
      corners[i] += 0.3 * Eigen::Vector2d(std::sin(31.0 * static_cast<double>(i + k)),
                                          std::cos(17.0 * static_cast<double>(i + 3 * k)));
    flat.push_back(corners);
  }
  const auto untilted = fit_lens(640, 480, kBoard, flat);
  ASSERT_FALSE(untilted);
  EXPECT_NE(untilted.status().message().find("tilt the board"), std::string::npos)
      << untilted.status().message();
  auto swapped = corners_;
  for (auto& corners : swapped) std::swap(corners[3], corners[30]);
  const auto wrong = fit_lens(640, 480, kBoard, swapped);
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.status().message().find("does not fit"), std::string::npos);
  auto missing = corners_;
  missing[1].pop_back();
  EXPECT_FALSE(fit_lens(640, 480, kBoard, missing));
}

TEST_F(PicturedBoard, APictureWithoutTheBoardHasNoCorners) {
  const std::vector<std::uint8_t> grey(640 * 480, 128);
  EXPECT_FALSE(find_corners({640, 480, grey.data()}, kBoard));
  EXPECT_FALSE(find_corners({0, 0, nullptr}, kBoard));
  EXPECT_FALSE(find_corners({640, 480, grey.data()}, {1, 1, 0.02}));
}

}  // namespace
}  // namespace phantom::camera
