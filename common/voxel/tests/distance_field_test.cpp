#include "common/voxel/distance_field.hpp"

#include <gtest/gtest.h>

#include <random>

#include "common/geometry/point_triangle.hpp"
#include "common/geometry/primitives.hpp"

namespace phantom::voxel {
namespace {

using Eigen::Vector3d;
using geometry::Pose;

const GridSpec kGrid{{-0.5, -0.5, -0.5}, 0.01, {100, 100, 100}};

double mesh_distance(const geometry::TriangleMesh& mesh, const Vector3d& p) {
  double best = 1e30;
  for (const auto& t : mesh.triangles) {
    best = std::min(best, (geometry::closest_point_on_triangle(p, mesh.vertices_m[t[0]].cast<double>(),
                                                               mesh.vertices_m[t[1]].cast<double>(),
                                                               mesh.vertices_m[t[2]].cast<double>()) -
                           p)
                              .norm());
  }
  return best;
}

TEST(DistanceField, IsThatOfASphere) {
  const auto field = DistanceField::build(kGrid, {{geometry::make_sphere(0.2, 5), 3}});
  ASSERT_TRUE(field) << field.status().message();
  std::mt19937 random(1);
  std::uniform_real_distribution<double> coordinate(-0.29, 0.29);
  for (int i = 0; i < 20000; ++i) {
    const Vector3d p(coordinate(random), coordinate(random), coordinate(random));
    const double exact = p.norm() - 0.2;
    if (exact > 0.05 || exact < -0.02) continue;
    EXPECT_NEAR(field->distance_m(p), exact, std::abs(exact) < 0.005 ? 2e-4 : 6e-4) << p.transpose();
    EXPECT_LT((field->gradient(p) - p.normalized()).norm(), 0.12) << p.transpose();
    EXPECT_EQ(field->object(p), 3);
  }
}

TEST(DistanceField, AgreesWithEveryTriangleAtVoxelCentres) {
  const Pose X_WO{geometry::rotation_from_rpy(0.4, 0.7, -0.3), {0.05, -0.03, 0.02}};
  const auto mesh = geometry::make_box({0.31, 0.17, 0.23}).transformed(X_WO);
  const auto field = DistanceField::build(kGrid, {{mesh, 1}});
  ASSERT_TRUE(field);
  std::mt19937 random(2);
  int compared = 0;
  for (int i = 0; i < 20000; ++i) {
    const Index3 v{static_cast<int>(random() % 100), static_cast<int>(random() % 100),
                   static_cast<int>(random() % 100)};
    const Vector3d p = kGrid.centre_of(v);
    const Vector3d local = X_WO.inverse() * p;
    const bool inside =
        std::abs(local.x()) < 0.155 && std::abs(local.y()) < 0.085 && std::abs(local.z()) < 0.115;
    const double exact = (inside ? -1 : 1) * mesh_distance(mesh, p);
    const double expected = std::clamp(exact, -0.03, 0.06);
    EXPECT_NEAR(field->distance_m(p), expected, 2e-5) << p.transpose();
    compared += std::abs(exact) < 0.05 ? 1 : 0;
  }
  EXPECT_GT(compared, 500);
}

TEST(DistanceField, OfManyBodiesIsThatOfTheNearest) {
  const auto left = geometry::make_sphere(0.1, 4).transformed({Eigen::Matrix3d::Identity(), {-0.12, 0, 0}});
  const auto right = geometry::make_sphere(0.1, 4).transformed({Eigen::Matrix3d::Identity(), {0.12, 0, 0}});
  const auto field = DistanceField::build(kGrid, {{left, 1}, {right, 2}});
  ASSERT_TRUE(field);
  EXPECT_NEAR(field->distance_m({-0.005, 0.0, 0.0}), 0.015, 6e-4);
  EXPECT_EQ(field->object({-0.015, 0.002, 0.002}), 1);
  EXPECT_EQ(field->object({0.015, 0.002, 0.002}), 2);
}

TEST(DistanceField, SaysFreeOutOfTheBandAndDeepInTheBody) {
  const auto field = DistanceField::build(kGrid, {{geometry::make_box({0.4, 0.4, 0.4}), 1}});
  ASSERT_TRUE(field);
  EXPECT_DOUBLE_EQ(field->distance_m({0, 0, 0}), -0.03);
  EXPECT_EQ(field->gradient({0, 0, 0}), Vector3d::Zero());
  EXPECT_DOUBLE_EQ(field->distance_m({0.45, 0.45, 0.45}), 0.06);
  EXPECT_DOUBLE_EQ(field->distance_m({9, 9, 9}), 0.06);
  EXPECT_DOUBLE_EQ(field->distance_m({std::nan(""), 0, 0}), 0.06);
  EXPECT_EQ(field->object({9, 9, 9}), 0);
  EXPECT_LT(field->bytes(), 100U * 100U * 100U * 4U);
}

TEST(DistanceField, GradientIsTheSlopeOfTheDistance) {
  const auto field = DistanceField::build(kGrid, {{geometry::make_torus(0.2, 0.07), 1}});
  ASSERT_TRUE(field);
  std::mt19937 random(4);
  std::uniform_real_distribution<double> coordinate(-0.3, 0.3);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d p(coordinate(random), coordinate(random), coordinate(random));
    const double h = 1e-7;
    Vector3d difference;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = h * Vector3d::Unit(axis);
      difference[axis] = (field->distance_m(p + step) - field->distance_m(p - step)) / (2 * h);
    }
    EXPECT_LT((field->gradient(p) - difference).norm(), 1e-5);
  }
}

TEST(DistanceField, RefusesWhatItCannotHold) {
  const auto sphere = geometry::make_sphere(0.2, 2);
  EXPECT_FALSE(DistanceField::build(kGrid, {{sphere, 1}}, {.outside_m = 0.0}));
  EXPECT_FALSE(DistanceField::build(kGrid, {{sphere, 1}}, {.outside_m = 0.7}));
  const auto huge = geometry::make_sphere(1e4, 2);
  const auto refused = DistanceField::build(kGrid, {{huge, 5}});
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.status().message().find("body 5"), std::string::npos);
}

}  // namespace
}  // namespace phantom::voxel
