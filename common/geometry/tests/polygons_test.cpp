#include "common/geometry/importer/polygons.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

namespace phantom::geometry::detail::polygons_test {
namespace {

Eigen::Vector3d area_of(const std::vector<Eigen::Vector3d>& polygon) {
  Eigen::Vector3d twice = Eigen::Vector3d::Zero();
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i)
    twice += (polygon[i] - polygon[0]).cross(polygon[i + 1] - polygon[0]);
  return twice / 2;
}

/// The triangles have the polygon's area and all turn as it does.
void expect_fills(const std::vector<Eigen::Vector3d>& polygon) {
  const auto triangles = triangulated(polygon);
  ASSERT_EQ(triangles.size(), polygon.size() - 2);
  const Eigen::Vector3d whole = area_of(polygon), normal = whole.normalized();
  double sum = 0.0;
  for (const auto& [a, b, c] : triangles) {
    const double part = area_of({polygon[a], polygon[b], polygon[c]}).dot(normal);
    EXPECT_GE(part, -1e-12);
    sum += part;
  }
  EXPECT_NEAR(sum, whole.norm(), 1e-9 * whole.norm());
}

/// A polygon around a middle that sees all corners, with radii of any kind: mostly not convex.
std::vector<Eigen::Vector3d> random_polygon(std::mt19937& random) {
  std::uniform_real_distribution<double> share(0.0, 1.0);
  const int corners = 3 + static_cast<int>(random() % 20);
  std::vector<double> angles_rad(static_cast<std::size_t>(corners));
  for (int i = 0; i < corners; ++i)
    angles_rad[static_cast<std::size_t>(i)] = (i + 0.9 * share(random)) * 2 * M_PI / corners;
  const Eigen::Quaterniond turn = Eigen::Quaterniond(Eigen::Vector4d::Random().normalized());
  std::vector<Eigen::Vector3d> polygon;
  for (const double angle_rad : angles_rad) {
    const double radius = 0.2 + share(random);
    polygon.push_back(turn *
                      Eigen::Vector3d(radius * std::cos(angle_rad), radius * std::sin(angle_rad), 3.0));
  }
  return polygon;
}

TEST(Polygons, AreFilledByTheirTrianglesWhateverTheirShapeAndPose) {
  std::mt19937 random(5);
  for (int round = 0; round < 2000; ++round) {
    auto polygon = random_polygon(random);
    expect_fills(polygon);
    std::reverse(polygon.begin(), polygon.end());
    expect_fills(polygon);
    if (HasFailure()) return;
  }
}

TEST(Polygons, ACornerThatPointsInwardsIsNotCutAcross) {
  // An L, of which a fan from the first corner would cover the notch.
  expect_fills({{1, 1, 0}, {0, 1, 0}, {0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 2, 0}});
}

TEST(Polygons, CornersOnALineAndDoubledCornersAreNoObstacle) {
  EXPECT_EQ(triangulated(std::vector<Eigen::Vector3d>{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}})
                .size(),
            3u);
  EXPECT_EQ(triangulated(std::vector<Eigen::Vector3d>{{0, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 1, 0}}).size(),
            2u);
  EXPECT_EQ(triangulated(std::vector<Eigen::Vector3d>{{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}}).size(), 2u)
      << "one that crosses itself";
}

}  // namespace
}  // namespace phantom::geometry::detail::polygons_test
