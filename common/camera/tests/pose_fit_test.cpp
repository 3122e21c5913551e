#include "common/camera/pose_fit.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>

#include "common/camera/tests/synthetic_camera.hpp"

namespace phantom::camera {
namespace {

using geometry::Pose;
using test::looking;
using test::wide_lens;
using Points = std::vector<SeenPoint>;

const LensModel kLens(wide_lens());

/// The corners of a box that stands before the camera, seen with an error of `sigma_px` in each coordinate.
Points seen(const Pose& X_WC, const std::vector<Eigen::Vector3d>& corners, double sigma_px = 0.0,
            unsigned seed = 1) {
  std::mt19937 random(seed);
  std::normal_distribution<double> error(0.0, 1.0);
  Points points;
  for (const Eigen::Vector3d& corner : corners) {
    const Eigen::Vector2d pixel = test::project_by_hand(wide_lens(), X_WC.inverse() * corner);
    points.push_back({corner, pixel + sigma_px * Eigen::Vector2d(error(random), error(random))});
  }
  return points;
}

const std::vector<Eigen::Vector3d> kCorners{{0.0, 0.0, 0.0}, {0.4, 0.0, 0.0},  {0.4, 0.3, 0.0},
                                            {0.0, 0.3, 0.1}, {0.0, 0.0, 0.35}, {0.4, 0.0, 0.3}};

double position_error(const PoseFit& fit, const Pose& truth) {
  return (fit.X_WC.translation_m - truth.translation_m).norm();
}

TEST(PoseOfThreePoints, TheTrueOneIsAmongThemFromWhereverTheyAreSeen) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> share(-1.0, 1.0);
  int missed = 0, several = 0;
  for (int k = 0; k < 2000; ++k) {
    const auto point = [&]() -> Eigen::Vector3d {
      return Eigen::Vector3d(share(random), share(random), share(random)) * 0.4;
    };
    const Eigen::Vector3d eye = Eigen::Vector3d(share(random), share(random), share(random)).normalized() * 2;
    const Pose truth = looking(eye, 0.1 * point(), 3 * share(random));
    const std::vector<Eigen::Vector3d> corners{point(), point(), point()};
    const Points points = seen(truth, corners);
    const auto poses = poses_of_three(kLens, {points[0], points[1], points[2]});
    EXPECT_LE(poses.size(), 4U);
    several += poses.size() > 1;
    bool found = false;
    for (const Pose& pose : poses) {
      found = found || ((pose.translation_m - truth.translation_m).norm() < 1e-4 &&
                        geometry::rotation_vector(pose.rotation.transpose() * truth.rotation).norm() < 1e-4);
      for (std::size_t i = 0; i < 3; ++i) {
        const auto pixel = kLens.project(pose.inverse() * corners[i]);
        if (pixel) {
          EXPECT_LT((*pixel - points[i].pixel).norm(), 0.05) << "each of them explains the picture";
        }
      }
    }
    missed += found ? 0 : 1;
  }
  EXPECT_LE(missed, 6) << "near the danger cylinder two solutions merge";
  EXPECT_GT(several, 800) << "three points alone are ambiguous";
}

TEST(PoseFromCorners, ItsJacobianIsThatOfFiniteDifferences) {
  const Pose X_WC = looking({1.2, -1.0, 0.8}, {0.2, 0.1, 0.1}, 0.3);
  constexpr double kStep = 1e-6;
  for (const Eigen::Vector3d& corner : kCorners) {
    const auto J = pixel_by_pose(kLens, X_WC, corner);
    for (int i = 0; i < 6; ++i) {
      Eigen::Matrix<double, 6, 1> by = Eigen::Matrix<double, 6, 1>::Zero();
      const auto pixel = [&](double step) {
        by(i) = step;
        const Pose moved = X_WC * Pose{geometry::rotation_from_vector(by.head<3>()), by.tail<3>()};
        return *kLens.project(moved.inverse() * corner);
      };
      const Eigen::Vector2d slope = (pixel(kStep) - pixel(-kStep)) / (2 * kStep);
      EXPECT_LT((J.col(i) - slope).norm(), 1e-4 * (1 + slope.norm()));
    }
  }
}

TEST(PoseFromCorners, ExactPicksGiveTheExactPose) {
  for (const std::size_t count : {std::size_t{4}, std::size_t{6}}) {
    const Pose truth = looking({1.2, -1.0, 0.8}, {0.2, 0.1, 0.1}, 0.2);
    const auto fit =
        fit_pose(kLens, seen(truth, {kCorners.end() - static_cast<long>(count), kCorners.end()}));
    ASSERT_TRUE(fit) << fit.status().message();
    EXPECT_LT(position_error(*fit, truth), 1e-7);
    EXPECT_LT(fit->rms_px, 1e-6);
    EXPECT_EQ(fit->solutions, 1);
  }
}

// Statistics: the error of a pose has the covariance that is told. Its square in units of it has mean 6 and
// variance 12, so the mean of 300 lies within 6 ± 0.8 (4 sigma).
TEST(PoseFromCorners, TheErrorIsAsLargeAsItIsToldOverManyPicks) {
  const Pose truth = looking({1.1, -0.9, 0.7}, {0.2, 0.1, 0.15});
  constexpr int kSeeds = 300;
  double sum = 0.0;
  int within = 0;
  for (unsigned seed = 1; seed <= kSeeds; ++seed) {
    const auto fit = fit_pose(kLens, seen(truth, kCorners, 1.0, seed), {.pixel_sigma_px = 1.0});
    ASSERT_TRUE(fit) << fit.status().message();
    const Pose off = fit->X_WC.inverse() * truth;
    Eigen::Matrix<double, 6, 1> error;
    error << geometry::rotation_vector(off.rotation), off.translation_m;
    // The scatter of so few residuals says little: what is told is at least that of the stated pixel error.
    sum += error.dot(fit->covariance.inverse() * error);
    within += position_error(*fit, truth) < 2.8 * fit->position_sigma_m();
  }
  EXPECT_LT(sum / kSeeds, 6.8);
  EXPECT_GT(sum / kSeeds, 3.5) << "nor is it exaggerated";
  EXPECT_GE(within, kSeeds * 97 / 100);
}

TEST(PoseFromCorners, TheResidualInMillimetresIsThatAtTheCorners) {
  const Pose truth = looking({1.1, -0.9, 0.7}, {0.2, 0.1, 0.15});
  Points points = seen(truth, kCorners);
  points[2].pixel.x() += 6.0;
  const auto fit = fit_pose(kLens, points);
  ASSERT_TRUE(fit) << fit.status().message();
  EXPECT_GT(fit->rms_px, 0.5);
  // f ≈ 517 px: a pixel at the mean distance is distance / 517 wide.
  EXPECT_NEAR(fit->rms_mm, 1e3 * fit->rms_px * fit->distance_m / 517.5, 0.01 * fit->rms_mm);
  EXPECT_NEAR(fit->distance_m, 1.45, 0.15);
}

TEST(PoseFromCorners, ThreeNeedARoughPoseWhichDecides) {
  const Pose truth = looking({1.2, -1.0, 0.8}, {0.2, 0.1, 0.1});
  const Points points = seen(truth, {kCorners.begin(), kCorners.begin() + 3});
  const auto refused = fit_pose(kLens, points);
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.status().message().find("pick a fourth one, or give a rough pose"), std::string::npos);
  const Pose rough = looking({1.3, -0.9, 0.9}, {0.25, 0.05, 0.1}, 0.05);
  const auto fit = fit_pose(kLens, points, {.prior = rough});
  ASSERT_TRUE(fit) << fit.status().message();
  EXPECT_LT(position_error(*fit, truth), 1e-5);
}

TEST(PoseFromCorners, AFourthOneDecidesBetweenAllPosesOfThree) {
  int ambiguous = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> share(-1.0, 1.0);
    std::vector<Eigen::Vector3d> corners;
    for (int i = 0; i < 4; ++i)
      corners.push_back(0.35 * Eigen::Vector3d(share(random), share(random), share(random)));
    const Pose truth = looking({1.5 * share(random), -1.6, 0.9}, {0, 0, 0}, share(random));
    const auto fit = fit_pose(kLens, seen(truth, corners, 0.2, seed), {.pixel_sigma_px = 0.2});
    ambiguous += fit ? 0 : 1;  // told, not guessed
    if (fit) {
      EXPECT_LT(position_error(*fit, truth), 6 * fit->position_sigma_m()) << seed;
    }
  }
  EXPECT_LT(ambiguous, 25);
}

TEST(PoseFromCorners, DegenerateOrWrongPicksAreRefusedInWords) {
  const Pose truth = looking({1.2, -1.0, 0.8}, {0.2, 0.1, 0.1});
  const auto why = [](const core::Expected<PoseFit>& fit) { return fit ? "" : fit.status().message(); };
  EXPECT_NE(
      why(fit_pose(kLens, seen(truth, {kCorners[0], kCorners[1]}))).find("needs three points, there are 2"),
      std::string::npos);
  const std::vector<Eigen::Vector3d> line{{0, 0, 0}, {0.1, 0, 0}, {0.2, 0.0005, 0}, {0.4, 0, 0}};
  EXPECT_NE(why(fit_pose(kLens, seen(truth, line), {.prior = truth})).find("in line"), std::string::npos);
  const std::vector<Eigen::Vector3d> place{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  EXPECT_NE(why(fit_pose(kLens, seen(truth, place))).find("in one place"), std::string::npos);
  Points wrong = seen(truth, kCorners);
  std::swap(wrong[0].position_W_m, wrong[4].position_W_m);
  EXPECT_NE(why(fit_pose(kLens, wrong)).find("A point was picked wrongly"), std::string::npos);
  Points nan = seen(truth, kCorners);
  nan[1].pixel.x() = std::nan("");
  EXPECT_NE(why(fit_pose(kLens, nan)).find("no number"), std::string::npos);
  Points outside = seen(truth, kCorners);
  for (SeenPoint& point : outside) point.pixel += Eigen::Vector2d(1e5, 1e5);
  EXPECT_FALSE(fit_pose(kLens, outside));
}

}  // namespace
}  // namespace phantom::camera
