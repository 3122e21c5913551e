#include "common/geometry/ray_triangle.hpp"

#include <gtest/gtest.h>

#include <random>

namespace phantom::geometry {
namespace {

TEST(RayTriangle, MeetsAPointThatWasMadeOfTheCornersWithinAndNoneWithout) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1, 1), share(0.001, 0.999);
  const auto point = [&] { return Eigen::Vector3d(number(random), number(random), number(random)); };
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector3d a = point(), b = point(), c = point(), origin = point();
    double u = share(random), v = share(random);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    if (u + v > 0.999) continue;
    const Eigen::Vector3d inside = a + u * (b - a) + v * (c - a),
                          outside = a + (1.01 - v) * (b - a) + v * (c - a);
    const double s = 0.5 + share(random);
    const auto at = ray_meets_triangle(origin, (inside - origin) / s, a, b, c);
    ASSERT_TRUE(at);
    EXPECT_NEAR(*at, s, 1e-6);
    EXPECT_FALSE(ray_meets_triangle(origin, outside - origin, a, b, c));
  }
  EXPECT_FALSE(ray_meets_triangle({0, 0, 1}, {1, 0, 0}, {0, 0, 0}, {1, 0, 0}, {0, 1, 0})) << "parallel";
}

}  // namespace
}  // namespace phantom::geometry
