#include "common/geometry/implicit/polygonise.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numbers>

namespace phantom::geometry {
namespace {

using Eigen::Vector3d;

/// Hides that a shape could make its own mesh.
class Anonymous final : public ImplicitSolid {
 public:
  explicit Anonymous(ImplicitPtr solid) : solid_(std::move(solid)) {}
  double value(const Vector3d& p) const override { return solid_->value(p); }
  Interval bounds(const Region& region) const override { return solid_->bounds(region); }
  Box bounding_box() const override { return solid_->bounding_box(); }

 private:
  ImplicitPtr solid_;
};

const Pose kTilted{rotation_from_rpy(0.4, -0.7, 1.1), {0.3, -0.1, 0.2}};

/// Whether along every edge as many triangles run one way as the other.
bool closed_and_oriented(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> balance;
  for (const auto& t : mesh.triangles) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = t[i], b = t[(i + 1) % 3];
      balance[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  for (const auto& [edge, sum] : balance) {
    if (sum != 0) return false;
  }
  return !mesh.triangles.empty();
}

double farthest_off(const TriangleMesh& mesh, const ImplicitSolid& solid) {
  double most = 0.0;
  for (const auto& vertex : mesh.vertices_m)
    most = std::max(most, std::abs(solid.value(vertex.cast<double>())));
  return most;
}

ImplicitPtr drilled_block() {
  const auto drill =
      implicit_placed(implicit_cylinder(0.05, 1.0), {rotation_from_rpy(1.2, 0, 0), {0.02, 0, 0}});
  return implicit_placed(implicit_difference({implicit_box({0.3, 0.2, 0.25}), drill}), kTilted);
}

TEST(Polygonise, EverySolidBecomesClosedAndFacesOutwards) {
  const auto gyroid =
      Formula::parse("sin(20*x)*cos(20*y) + sin(20*y)*cos(20*z) + sin(20*z)*cos(20*x)", {"x", "y", "z"});
  ASSERT_TRUE(gyroid);
  const Box cube{Vector3d::Constant(-0.3), Vector3d::Constant(0.3)};
  const ImplicitPtr solids[] = {
      implicit_placed(implicit_torus(0.2, 0.06), kTilted), drilled_block(), implicit_formula(*gyroid, cube),
      implicit_union(
          {implicit_box({0.2, 0.2, 0.2}),
           implicit_placed(implicit_box({0.2, 0.2, 0.2}), {Eigen::Matrix3d::Identity(), {0.2, 0.2, 0}})})};
  for (const ImplicitPtr& solid : solids) {
    const TriangleMesh mesh = polygonise(Anonymous(solid)).mesh;
    EXPECT_TRUE(closed_and_oriented(mesh));
    EXPECT_GT(enclosed_volume_m3(mesh), 0.0);
  }
}

TEST(Polygonise, HasTheVolumeOfTheSolidAndItsSurface) {
  struct Case {
    ImplicitPtr solid;
    double volume_m3;
  };
  constexpr double kPi = std::numbers::pi;
  const Case cases[] = {{implicit_sphere(0.3), 4.0 / 3 * kPi * 0.027},
                        {implicit_torus(0.25, 0.08), 2 * kPi * kPi * 0.25 * 0.0064},
                        {implicit_placed(implicit_box({0.3, 0.5, 0.2}), kTilted), 0.03},
                        {implicit_placed(implicit_cylinder(0.2, 0.5), kTilted), kPi * 0.04 * 0.5}};
  for (const Case& one : cases) {
    const TriangleMesh mesh = polygonise(Anonymous(one.solid)).mesh;
    EXPECT_NEAR(enclosed_volume_m3(mesh), one.volume_m3, 0.003 * one.volume_m3);
    EXPECT_LT(farthest_off(mesh, *one.solid), 5e-4) << "cells are 8 to 10 mm";
  }
}

TEST(Polygonise, KeepsSharpCorners) {
  const auto box = implicit_placed(implicit_box({0.3, 0.5, 0.2}), kTilted);
  const TriangleMesh mesh = polygonise(Anonymous(box)).mesh;
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3d p = kTilted * Vector3d((corner & 1) * 0.3 - 0.15, (corner >> 1 & 1) * 0.5 - 0.25,
                                          (corner >> 2) * 0.2 - 0.1);
    double nearest = 1e9;
    for (const auto& vertex : mesh.vertices_m)
      nearest = std::min(nearest, (vertex.cast<double>() - p).norm());
    EXPECT_LT(nearest, 1e-3) << "cells are 8 mm";
  }
}

TEST(Polygonise, FindsWallsThinnerThanACellAndCutsFiner) {
  const auto plate = implicit_placed(implicit_box({0.5, 0.4, 0.003}), kTilted);
  const Polygonised made = polygonise(Anonymous(plate));
  EXPECT_GT(made.cells, 64) << "cells of the first try are 8 mm";
  EXPECT_TRUE(made.whole);
  EXPECT_TRUE(closed_and_oriented(made.mesh));
  EXPECT_NEAR(enclosed_volume_m3(made.mesh), 0.5 * 0.4 * 0.003, 0.05 * 0.5 * 0.4 * 0.003);
}

TEST(Polygonise, KeepsThePipesWallApart) {
  const auto tube = implicit_placed(
      implicit_difference({implicit_cylinder(0.05, 0.36), implicit_cylinder(0.044, 0.5)}), kTilted);
  const Polygonised made = polygonise(*tube);
  EXPECT_TRUE(made.whole);
  const double volume_m3 = std::numbers::pi * (0.05 * 0.05 - 0.044 * 0.044) * 0.36;
  EXPECT_NEAR(enclosed_volume_m3(made.mesh), volume_m3, 0.02 * volume_m3);
}

TEST(Polygonise, SaysWhatIsTooThinForIt) {
  const auto foil = implicit_placed(implicit_box({0.5, 0.4, 0.0001}), kTilted);
  EXPECT_FALSE(polygonise(Anonymous(foil), {.cells = 32, .max_cells = 64}).whole);
}

TEST(Polygonise, APlainShapeMakesItsOwnMesh) {
  const Polygonised made = polygonise(*implicit_placed(implicit_box({0.3, 0.5, 0.2}), kTilted, 2.0));
  EXPECT_EQ(made.mesh.triangles.size(), 12U);
  EXPECT_NEAR(enclosed_volume_m3(made.mesh), 8 * 0.03, 1e-6);
}

TEST(Polygonise, NothingInsideGivesNothing) {
  const auto apart = implicit_placed(implicit_sphere(0.1), {Eigen::Matrix3d::Identity(), {1, 0, 0}});
  EXPECT_TRUE(polygonise(*implicit_intersection({implicit_sphere(0.1), apart})).mesh.triangles.empty());
}

TEST(Polygonise, EndsWithoutAMeshWhenItsBudgetIsUsedUp) {
  const auto f = Formula::parse("sin(900*x)*sin(900*y)*sin(900*z)", {"x", "y", "z"});
  ASSERT_TRUE(f);
  const auto solid = implicit_formula(*f, {Vector3d::Constant(-0.3), Vector3d::Constant(0.3)});
  core::WorkBudget budget(10'000'000);
  EXPECT_TRUE(polygonise(*solid, {.budget = &budget}).mesh.triangles.empty());
  EXPECT_TRUE(budget.exceeded());
  EXPECT_LE(budget.spent(), 10'000'000 + 4 * core::WorkMeter::kEvery);
  core::WorkBudget enough;
  const auto ball =
      implicit_placed(implicit_union({implicit_sphere(0.1), implicit_box({0.1, 0.1, 0.3})}), {});
  EXPECT_FALSE(polygonise(*ball, {.budget = &enough}).mesh.triangles.empty());
  EXPECT_GT(enough.spent(), 0U);
}

}  // namespace
}  // namespace phantom::geometry
