#include "common/geometry/point_triangle.hpp"

#include <gtest/gtest.h>

#include <random>

namespace phantom::geometry {
namespace {

/// The literal twin: the least distance over a fine net of the triangle's points.
double sampled_distance(const Eigen::Vector3d& p, const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                        const Eigen::Vector3d& c, int n) {
  double best = 1e30;
  for (int i = 0; i <= n; ++i) {
    for (int j = 0; i + j <= n; ++j) {
      const double u = static_cast<double>(i) / n, v = static_cast<double>(j) / n;
      best = std::min(best, (a + u * (b - a) + v * (c - a) - p).norm());
    }
  }
  return best;
}

TEST(PointTriangle, AgreesWithANetOfSamples) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> coordinate(-1, 1);
  const auto point = [&] {
    return Eigen::Vector3d(coordinate(random), coordinate(random), coordinate(random));
  };
  constexpr int kNet = 60;
  for (int round = 0; round < 300; ++round) {
    const Eigen::Vector3d a = point(), b = point(), c = point(), p = 1.5 * point();
    const double distance = (closest_point_on_triangle(p, a, b, c) - p).norm();
    const double sampled = sampled_distance(p, a, b, c, kNet);
    EXPECT_LE(distance, sampled + 1e-12);
    EXPECT_GE(distance, sampled - 3.5 / kNet);  // no farther than the net's mesh width
  }
}

TEST(PointTriangle, PointOnTheFaceIsItself) {
  const Eigen::Vector3d a(0, 0, 0), b(1, 0, 0), c(0, 1, 0), p(0.2, 0.3, 0.0);
  EXPECT_LT((closest_point_on_triangle(p, a, b, c) - p).norm(), 1e-15);
}

TEST(PointTriangle, TakesDegenerateTrianglesAsSegmentsAndPoints) {
  const Eigen::Vector3d a(0, 0, 0), b(2, 0, 0), p(1.5, 1, 0);
  EXPECT_TRUE(closest_point_on_triangle(p, a, b, {1, 0, 0}).isApprox(Eigen::Vector3d(1.5, 0, 0)));
  EXPECT_TRUE(closest_point_on_triangle(p, a, {1, 0, 0}, b).isApprox(Eigen::Vector3d(1.5, 0, 0)));
  EXPECT_TRUE(closest_point_on_triangle(p, b, b, b).isApprox(b));
}

}  // namespace
}  // namespace phantom::geometry
