#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/mesh/winding_number.hpp"
#include "common/voxelise/tests/meshes_in_a_grid.hpp"

// Meshes as they come: the solid must be the one that was meant, and never leak.

namespace phantom::voxelise {
namespace {

using Eigen::Vector3d;
using geometry::Pose;
using geometry::TriangleMesh;

Pose at(double x, double y, double z) { return {geometry::rotation_from_rpy(0.31, -0.72, 1.13), {x, y, z}}; }

TriangleMesh flipped(TriangleMesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

TriangleMesh both(TriangleMesh a, const TriangleMesh& b) {
  a.append(b);
  return a;
}

/// Voxels inside `bad` that are neither inside nor on the boundary of `good`.
std::size_t leaked(const SolidVoxels& bad, const SolidVoxels& good) {
  std::size_t count = 0;
  twin::for_each(kAll, [&](workspace::Index3 v) {
    count += twin::is_inside(bad, v) && !twin::is_solid(good, v) ? 1 : 0;
  });
  return count;
}

/// Inside by the solid angle of all triangles, where no surface is near.
void expect_inside_by_solid_angle(const SolidVoxels& solid, const TriangleMesh& mesh) {
  std::mt19937 random(4);
  int asked = 0;
  while (asked < 400) {
    const workspace::Index3 v{static_cast<std::int32_t>(random() % 80),
                              static_cast<std::int32_t>(random() % 80),
                              static_cast<std::int32_t>(random() % 80)};
    if (twin::is_boundary(solid, v)) continue;
    const double w = geometry::winding_number(mesh, kGrid.centre_of(v));
    ASSERT_NEAR(w, std::round(w), 1e-6);
    ASSERT_EQ(twin::is_inside(solid, v), std::abs(w) > 0.5) << v.x << ' ' << v.y << ' ' << v.z;
    ++asked;
  }
}

TEST(BadMesh, OverlappingShellsAreFilled) {
  const TriangleMesh a = geometry::make_sphere(0.2, 3).transformed(at(-0.05, 0, 0));
  const TriangleMesh b = geometry::make_box({0.3, 0.2, 0.25}).transformed(at(0.08, 0.03, 0));
  const auto one = solid_of(a), other = solid_of(b), together = solid_of(both(a, b));
  EXPECT_TRUE(together.report.closed);
  twin::for_each(kAll, [&](workspace::Index3 v) {
    EXPECT_EQ(twin::is_inside(together, v), twin::is_inside(one, v) || twin::is_inside(other, v));
  });
  expect_inside_by_solid_angle(together, both(a, b));
}

TEST(BadMesh, AShellThatFacesInwardsWithinAnotherIsACavity) {
  const TriangleMesh outer = geometry::make_sphere(0.25, 3).transformed(at(0, 0, 0));
  const TriangleMesh hole = geometry::make_box({0.15, 0.2, 0.1}).transformed(at(0.02, 0, 0.03));
  const auto whole = solid_of(outer), cavity = solid_of(hole), hollow = solid_of(both(outer, flipped(hole)));
  twin::for_each(kAll, [&](workspace::Index3 v) {
    EXPECT_EQ(twin::is_inside(hollow, v), twin::is_inside(whole, v) && !twin::is_inside(cavity, v));
  });
  EXPECT_EQ(differing(hollow, solid_of(flipped(both(outer, flipped(hole))))), 0U);
}

TEST(BadMesh, AShellThatFacesInwardsBesideAnotherIsTurnedOver) {
  const TriangleMesh a = geometry::make_sphere(0.2, 3).transformed(at(-0.05, 0, 0));
  const TriangleMesh b = geometry::make_box({0.3, 0.2, 0.25}).transformed(at(0.08, 0.03, 0));
  const auto right = solid_of(both(a, b)), one_wrong = solid_of(both(a, flipped(b)));
  EXPECT_EQ(differing(right, one_wrong), 0U);
  EXPECT_EQ(one_wrong.report.turned_triangles, 12U);
  EXPECT_EQ(differing(right, solid_of(both(flipped(a), b))), 0U);
}

TEST(BadMesh, WhichWayTrianglesFaceDoesNotMatter) {
  const TriangleMesh mesh = geometry::make_torus(0.2, 0.08, 40, 20).transformed(at(0.01, 0, 0));
  const auto whole = solid_of(mesh);
  EXPECT_EQ(differing(whole, solid_of(flipped(mesh))), 0U);
  std::mt19937 random(5);
  TriangleMesh mixed = mesh;
  std::size_t turned = 0;
  for (auto& t : mixed.triangles) {
    if (random() % 10 < 3) {
      std::swap(t[1], t[2]);
      ++turned;
    }
  }
  const auto repaired = solid_of(mixed);
  EXPECT_EQ(differing(whole, repaired), 0U);
  EXPECT_EQ(repaired.report.turned_triangles, turned);
  EXPECT_TRUE(repaired.report.closed);
}

TEST(BadMesh, RepeatedTrianglesDoNotMatter) {
  const TriangleMesh mesh = geometry::make_sphere(0.25, 3).transformed(at(0, 0.02, 0));
  const auto whole = solid_of(mesh);
  std::mt19937 random(6);
  TriangleMesh again = mesh;
  for (int i = 0; i < 60; ++i) {
    auto t = mesh.triangles[random() % mesh.triangles.size()];
    if (i % 2 == 0) std::swap(t[0], t[2]);
    again.triangles.push_back(t);
  }
  again.triangles.push_back({3, 3, 7});
  const auto repaired = solid_of(again);
  EXPECT_EQ(differing(whole, repaired), 0U);
  EXPECT_TRUE(repaired.report.closed);
  EXPECT_GE(repaired.report.duplicate_triangles, 60U);
  EXPECT_EQ(repaired.report.degenerate_triangles, 1U);
  EXPECT_EQ(differing(whole, solid_of(both(mesh, mesh))), 0U);
}

TEST(BadMesh, TrianglesThatAllStandThereOnceForEachSideDoNotMatter) {
  const TriangleMesh box = geometry::make_box({0.3, 0.2, 0.25}).transformed(at(0.02, 0.03, 0));
  TriangleMesh double_sided = box;
  for (const auto& t : flipped(box).triangles) double_sided.triangles.push_back(t);
  const auto good = solid_of(box);
  for (const TriangleMesh& mesh : {double_sided, both(box, flipped(box))}) {  // corners shared, or not
    const auto solid = solid_of(mesh);
    EXPECT_TRUE(solid.report.closed);
    EXPECT_EQ(solid.inside.words(), good.inside.words());
  }
}

TEST(BadMesh, APlateOfTwoFacesInOnePlaceHasNoInside) {
  TriangleMesh sheet{{{-0.2F, -0.2F, 0.003F}, {0.2F, -0.2F, 0.003F}, {0.0F, 0.2F, 0.003F}},
                     {{0, 1, 2}, {0, 2, 1}}};
  const auto solid = solid_of(sheet);
  EXPECT_EQ(solid.inside.count(), 0U);
  EXPECT_GT(solid.boundary.count(), 100U);
}

TEST(BadMesh, CornersThatAreNotSharedDoNotMatter) {
  const TriangleMesh mesh = geometry::make_torus(0.2, 0.08, 30, 15).transformed(at(0.01, 0, 0));
  TriangleMesh soup;
  for (const auto& t : mesh.triangles) {
    const auto n = static_cast<std::uint32_t>(soup.vertices_m.size());
    for (const auto v : t) soup.vertices_m.push_back(mesh.vertices_m[v]);
    soup.triangles.push_back({n, n + 1, n + 2});
  }
  const auto solid = solid_of(soup);
  EXPECT_TRUE(solid.report.closed);
  EXPECT_EQ(differing(solid_of(mesh), solid), 0U);
}

/// Deep voxels must be as those of the intact mesh, and nothing may be inside that is outside.
void expect_same_away_from_the_surface(const SolidVoxels& bad, const SolidVoxels& good, std::int32_t away) {
  EXPECT_EQ(leaked(bad, good), 0U);
  std::size_t lost = 0;
  twin::for_each(kAll, [&](workspace::Index3 v) {
    if (!twin::is_inside(good, v) || twin::is_inside(bad, v)) return;
    bool near = false;
    twin::for_each({{v.x - away, v.y - away, v.z - away}, {2 * away + 1, 2 * away + 1, 2 * away + 1}},
                   [&](workspace::Index3 w) { near = near || !twin::is_inside(good, w); });
    lost += near ? 0 : 1;
  });
  EXPECT_EQ(lost, 0U);
}

TEST(BadMesh, MissingTrianglesDoNotMatterAwayFromThem) {
  const TriangleMesh mesh = geometry::make_sphere(0.25, 4).transformed(at(0.013, 0, 0));
  const auto whole = solid_of(mesh);
  std::mt19937 random(7);
  for (const std::size_t missing : {1U, 20U, 200U}) {
    TriangleMesh open = mesh;
    for (std::size_t i = 0; i < missing; ++i)
      open.triangles.erase(open.triangles.begin() +
                           static_cast<std::ptrdiff_t>(random() % open.triangles.size()));
    const auto solid = solid_of(open);
    EXPECT_FALSE(solid.report.closed);
    expect_same_away_from_the_surface(solid, whole, 4);
  }
}

TEST(BadMesh, AHoleAsLargeAsAQuarterIsClosedBySomethingSmooth) {
  TriangleMesh bowl = geometry::make_sphere(0.25, 4);
  const auto whole = solid_of(bowl);
  std::erase_if(bowl.triangles, [&](const auto& t) { return bowl.vertices_m[t[0]].z() > 0.125F; });
  const auto solid = solid_of(bowl);
  EXPECT_EQ(leaked(solid, whole), 0U);
  // The part below the rim, and not much above it.
  twin::for_each(kAll, [&](workspace::Index3 v) {
    const Vector3d p = kGrid.centre_of(v);
    if (p.norm() < 0.24 && p.z() < 0.05) {
      EXPECT_TRUE(twin::is_inside(solid, v));
    }
    if (p.z() > 0.23) {
      EXPECT_FALSE(twin::is_inside(solid, v));
    }
  });
}

TEST(BadMesh, AnOpenMeshTellsHowFarItIsAndCanBeStopped) {
  TriangleMesh mesh = geometry::make_sphere(0.25, 3).transformed(at(0, 0, 0));
  mesh.triangles.resize(mesh.triangles.size() * 3 / 4);
  std::vector<double> shares;
  const auto note = [&shares](double share) {
    shares.push_back(share);
    return true;
  };
  const auto whole = voxelise(mesh, kGrid, kAll, {1, note});
  ASSERT_TRUE(whole);
  EXPECT_EQ(differing(*whole, solid_of(mesh, 2)), 0U);
  ASSERT_GT(shares.size(), 10U);
  EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
  EXPECT_GE(shares.front(), 0.0);
  EXPECT_LE(shares.back(), 1.0);
  int asked = 0;
  const auto stopped = voxelise(mesh, kGrid, kAll, {1, [&asked](double) { return ++asked < 3; }});
  ASSERT_FALSE(stopped);
  EXPECT_EQ(stopped.status().code(), core::ErrorCode::kUnavailable);
  EXPECT_EQ(asked, 3);
}

TEST(BadMesh, TJunctionsDoNotMatter) {
  // A box whose top has an extra corner on an edge that the side does not know.
  TriangleMesh mesh = geometry::make_box({0.4, 0.3, 0.2});
  const auto whole = solid_of(mesh.transformed(at(0.01, 0.02, 0)));
  std::mt19937 random(8);
  for (int round = 0; round < 6; ++round) {
    const std::size_t victim = random() % mesh.triangles.size();
    const auto t = mesh.triangles[victim];
    const auto extra = static_cast<std::uint32_t>(mesh.vertices_m.size());
    mesh.vertices_m.push_back(0.5F * (mesh.vertices_m[t[0]] + mesh.vertices_m[t[1]]));
    mesh.triangles[victim] = {t[0], extra, t[2]};
    mesh.triangles.push_back({extra, t[1], t[2]});
  }
  const auto solid = solid_of(mesh.transformed(at(0.01, 0.02, 0)));
  EXPECT_FALSE(solid.report.closed);
  expect_same_away_from_the_surface(solid, whole, 1);
}

TEST(BadMesh, ASheetDoesNotFlood) {
  TriangleMesh floor{
      {{-0.35F, -0.35F, 0.0F}, {0.35F, -0.35F, 0.0F}, {0.35F, 0.35F, 0.02F}, {-0.35F, 0.35F, 0.0F}},
      {{0, 1, 2}, {0, 2, 3}}};
  const auto solid = solid_of(floor);
  twin::for_each(kAll, [&](workspace::Index3 v) {
    if (twin::is_inside(solid, v)) {
      EXPECT_LT(std::abs(kGrid.centre_of(v).z() - 0.01), 0.03);
    }
  });
}

TEST(BadMesh, ArbitraryTrianglesNeverReachOutsideTheirBox) {
  std::mt19937 random(9);
  std::uniform_real_distribution<float> place(-0.2F, 0.2F);
  for (int round = 0; round < 10; ++round) {
    TriangleMesh soup;
    for (int i = 0; i < 60; ++i) soup.vertices_m.emplace_back(place(random), place(random), place(random));
    for (int i = 0; i < 100; ++i)
      soup.triangles.push_back({static_cast<std::uint32_t>(random() % 60),
                                static_cast<std::uint32_t>(random() % 60),
                                static_cast<std::uint32_t>(random() % 60)});
    const auto one = solid_of(soup), two = solid_of(soup, 3);
    EXPECT_EQ(one.inside.words(), two.inside.words());
    EXPECT_EQ(one.boundary.words(), two.boundary.words());
    EXPECT_EQ(one.report.disputed_voxels, two.report.disputed_voxels);
    const auto bounds = voxel_bounds(soup.bounding_box(), kGrid);
    twin::for_each(kAll, [&](workspace::Index3 v) {
      if (bounds.intersection({v, {1, 1, 1}}).empty()) {
        EXPECT_FALSE(twin::is_inside(one, v));
      }
    });
  }
}

TEST(BadMesh, ThreadsDoNotMatter) {
  const TriangleMesh mesh = both(geometry::make_torus(0.2, 0.08, 40, 20).transformed(at(0.01, 0, 0)),
                                 geometry::make_sphere(0.15, 4).transformed(at(0.1, 0.1, 0.1)));
  const auto one = solid_of(mesh);
  for (const int threads : {2, 3, 7, 200}) {
    const auto many = solid_of(mesh, threads);
    EXPECT_EQ(one.inside.words(), many.inside.words());
    EXPECT_EQ(one.boundary.words(), many.boundary.words());
  }
}

TEST(BadMesh, RefusesCoordinatesThatAreNotFinite) {
  TriangleMesh mesh = geometry::make_sphere(0.2, 2);
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
    mesh.vertices_m[5].y() = bad;
    const auto solid = voxelise(mesh, kGrid, kAll);
    ASSERT_FALSE(solid);
    EXPECT_EQ(solid.status().code(), core::ErrorCode::kInvalidArgument);
  }
  mesh.vertices_m[5].y() = 3e38F;
  EXPECT_EQ(voxelise(mesh, kGrid, kAll).status().code(), core::ErrorCode::kResourceExhausted);
}

/// A body of random boxes and spheres, cut short now and then.
TriangleMesh random_body(std::mt19937& random) {
  std::uniform_real_distribution<double> place(-0.12, 0.12), size(0.03, 0.2), angle(-3, 3);
  TriangleMesh body;
  for (int part = 0; part < 4; ++part) {
    const TriangleMesh shape = part % 2 == 0 ? geometry::make_box({size(random), size(random), size(random)})
                                             : geometry::make_sphere(size(random), 2);
    body.append(shape.transformed({geometry::rotation_from_rpy(angle(random), angle(random), angle(random)),
                                   {place(random), place(random), place(random)}}));
  }
  return body;
}

TEST(BadMesh, QuarterTurnsAndWholeVoxelStepsCommuteWithRandomBodies) {
  std::mt19937 random(10);
  for (int round = 0; round < 12; ++round) {
    TriangleMesh mesh = random_body(random);
    if (round % 3 == 2) mesh = flipped(mesh);
    const auto here = solid_of(mesh);
    EXPECT_TRUE(here.report.closed);
    TriangleMesh quarter = mesh, cycled = mesh;
    for (auto& v : quarter.vertices_m) v = Eigen::Vector3f(-v.y(), v.x(), v.z());
    for (auto& v : cycled.vertices_m) v = Eigen::Vector3f(v.y(), v.z(), v.x());
    const auto turned = solid_of(quarter), renamed = solid_of(cycled);
    const workspace::GridSpec moved_grid{kGrid.origin_m - 0.01 * Vector3d(5, -3, 7), 0.01, {80, 80, 80}};
    const auto moved = voxelise(mesh, moved_grid, workspace::VoxelBox::of(moved_grid));
    ASSERT_TRUE(moved);
    std::size_t wrong = 0;
    twin::for_each(kAll, [&](workspace::Index3 v) {
      const workspace::Index3 q{79 - v.y, v.x, v.z}, c{v.y, v.z, v.x}, m{v.x + 5, v.y - 3, v.z + 7};
      const bool in = twin::is_inside(here, v), on = twin::is_boundary(here, v);
      wrong += in != twin::is_inside(turned, q) || on != twin::is_boundary(turned, q) ? 1 : 0;
      wrong += in != twin::is_inside(renamed, c) || on != twin::is_boundary(renamed, c) ? 1 : 0;
      wrong += in != twin::is_inside(*moved, m) || on != twin::is_boundary(*moved, m) ? 1 : 0;
    });
    EXPECT_EQ(wrong, 0U) << "round " << round;
    expect_inside_by_solid_angle(here, mesh);
  }
}

}  // namespace
}  // namespace phantom::voxelise
