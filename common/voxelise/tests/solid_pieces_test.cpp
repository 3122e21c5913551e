#include "common/voxelise/solid_pieces.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/mesh/solid_moments.hpp"

namespace phantom::voxelise {
namespace {

struct SumOfPieces {
  double volume_m3 = 0.0;
  Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
};
SumOfPieces sum_of(const SolidPieces& solid) {
  SumOfPieces sum;
  for (const SolidPiece& piece : solid.pieces) {
    sum.volume_m3 += piece.volume_m3;
    sum.centre_m += piece.volume_m3 * piece.centre_m;
  }
  sum.centre_m /= sum.volume_m3;
  return sum;
}

geometry::TriangleMesh shifted(const geometry::TriangleMesh& mesh, const Eigen::Vector3d& by_m) {
  return mesh.transformed({Eigen::Matrix3d::Identity(), by_m});
}

TEST(SolidPieces, OfABoxHaveItsVolumeAndCentreAndFillIt) {
  const auto solid = solid_pieces(shifted(geometry::make_box({0.1, 0.2, 0.8}), {0.3, -0.1, 0.7}));
  ASSERT_TRUE(solid);
  EXPECT_TRUE(solid->closed);
  EXPECT_EQ(solid->pieces.size(), 1U * 2U * 8U);
  const SumOfPieces sum = sum_of(*solid);
  EXPECT_NEAR(sum.volume_m3, 0.016, 1e-7);
  EXPECT_TRUE(sum.centre_m.isApprox(Eigen::Vector3d(0.3, -0.1, 0.7), 1e-6)) << sum.centre_m;
  for (const SolidPiece& piece : solid->pieces) {
    EXPECT_NEAR(piece.volume_m3, 0.001, 1e-8);
    EXPECT_NEAR(piece.cell_m, 0.1, 1e-7);
  }
}

TEST(SolidPieces, OfRoundAndTurnedBodiesHaveTheirVolumeWithinAPercent) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> angle(-3.0, 3.0);
  for (const auto& mesh : {geometry::make_cylinder(0.03, 0.43, 48), geometry::make_cylinder(0.2, 0.05, 96),
                           geometry::make_cone(0.07, 0.0, 0.14, 96), geometry::make_sphere(0.1, 4),
                           geometry::make_box({0.1, 0.2, 0.8})}) {
    for (int i = 0; i < 6; ++i) {
      const geometry::Pose X{geometry::rotation_from_rpy(angle(random), angle(random), angle(random)),
                             {0.4, 0.1, -0.2}};
      const auto turned = mesh.transformed(i == 0 ? geometry::Pose() : X);
      const auto exact = geometry::solid_moments(turned);
      const SumOfPieces sum = sum_of(*solid_pieces(turned));
      EXPECT_NEAR(sum.volume_m3, exact.volume_m3, 0.01 * exact.volume_m3) << i;
      EXPECT_LT((sum.centre_m - exact.centre_m).norm(), 1e-3) << i;
    }
  }
}

TEST(SolidPieces, OfBodiesInOneAnotherCountOnce) {
  auto mesh = geometry::make_box({0.2, 0.2, 0.2});
  mesh.append(shifted(geometry::make_box({0.2, 0.2, 0.2}), {0.1, 0.0, 0.0}));
  EXPECT_NEAR(sum_of(*solid_pieces(mesh)).volume_m3, 0.3 * 0.2 * 0.2, 1e-4);
}

TEST(SolidPieces, OfWhatEnclosesNothingAreNone) {
  EXPECT_TRUE(solid_pieces({})->pieces.empty());
  geometry::TriangleMesh sheet;
  sheet.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  sheet.triangles = {{0, 1, 2}};
  const auto open = solid_pieces(sheet);
  ASSERT_TRUE(open);
  EXPECT_TRUE(open->pieces.empty());
  EXPECT_FALSE(open->closed);
  sheet.vertices_m[1].x() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(solid_pieces(sheet));
}

TEST(SolidPieces, OfABodyWithAHoleAreThoseOfTheBodyAndTold) {
  auto mesh = geometry::make_sphere(0.1, 4);
  const double whole_m3 = geometry::solid_moments(mesh).volume_m3;
  mesh.triangles.pop_back();
  const auto solid = solid_pieces(mesh);
  EXPECT_FALSE(solid->closed);
  EXPECT_NEAR(sum_of(*solid).volume_m3, whole_m3, 0.01 * whole_m3);
}

}  // namespace
}  // namespace phantom::voxelise
