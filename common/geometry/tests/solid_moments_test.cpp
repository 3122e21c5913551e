#include "common/geometry/mesh/solid_moments.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/pose.hpp"

namespace phantom::geometry {
namespace {

TriangleMesh placed(TriangleMesh mesh, const Pose& X) {
  for (auto& vertex : mesh.vertices_m) vertex = (X * vertex.cast<double>()).cast<float>();
  return mesh;
}

TEST(SolidMoments, AreThoseOfABox) {
  const SolidMoments m = solid_moments(make_box({0.2, 0.3, 0.5}));
  EXPECT_NEAR(m.volume_m3, 0.03, 1e-8);
  EXPECT_TRUE(m.centre_m.isZero(1e-7));
  const Eigen::Vector3d expected(0.09 + 0.25, 0.04 + 0.25, 0.04 + 0.09);
  EXPECT_TRUE(m.inertia_m2.isApprox(Eigen::Matrix3d((expected / 12.0).asDiagonal()), 1e-6)) << m.inertia_m2;
}

TEST(SolidMoments, OfABallAreNearlyThoseOfASphere) {
  const SolidMoments m = solid_moments(make_sphere(0.1, 5));
  EXPECT_NEAR(m.volume_m3, 4.0 / 3.0 * M_PI * 1e-3, 1e-5);
  EXPECT_TRUE(m.inertia_m2.isApprox(0.4 * 0.01 * Eigen::Matrix3d::Identity(), 5e-3));
}

TEST(SolidMoments, MoveAndTurnWithTheBodyWhicheverWayItsTrianglesFace) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  const TriangleMesh box = make_box({0.2, 0.3, 0.5});
  const SolidMoments at_home = solid_moments(box);
  for (int i = 0; i < 50; ++i) {
    const Pose X{rotation_from_rpy(3 * number(random), 3 * number(random), 3 * number(random)),
                 {number(random), number(random), number(random)}};
    TriangleMesh mesh = placed(box, X);
    if (i % 2 == 1)
      for (auto& triangle : mesh.triangles) std::swap(triangle[0], triangle[1]);
    const SolidMoments m = solid_moments(mesh);
    EXPECT_NEAR(m.volume_m3, at_home.volume_m3, 1e-7);
    EXPECT_TRUE(m.centre_m.isApprox(X * at_home.centre_m, 1e-5));
    EXPECT_TRUE(m.inertia_m2.isApprox(X.rotation * at_home.inertia_m2 * X.rotation.transpose(), 1e-4));
  }
}

TEST(SolidMoments, OfAnOpenMeshAreThoseOfItsBox) {
  TriangleMesh sheet;
  sheet.vertices_m = {{0, 0, 0}, {0.4F, 0, 0}, {0, 0.2F, 0}, {0.4F, 0.2F, 0}};
  sheet.triangles = {{0, 1, 2}, {1, 3, 2}};
  const SolidMoments m = solid_moments(sheet);
  EXPECT_TRUE(m.centre_m.isApprox(Eigen::Vector3d(0.2, 0.1, 0.0), 1e-6));
  EXPECT_NEAR(m.inertia_m2(2, 2), (0.16 + 0.04) / 12.0, 1e-8);
  EXPECT_EQ(solid_moments({}).volume_m3, 0.0);
}

}  // namespace
}  // namespace phantom::geometry
