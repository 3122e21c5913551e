#include "common/voxelise/voxelise.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/voxelise/tests/meshes_in_a_grid.hpp"

namespace phantom::voxelise {
namespace {

using Eigen::Vector3d;
using geometry::Pose;
using geometry::TriangleMesh;

Pose crooked() { return {geometry::rotation_from_rpy(0.31, -0.72, 1.13), {0.0123, -0.0231, 0.0077}}; }

/// As kGrid, of voxels that are no cubes.
const workspace::GridSpec kFlatGrid{
    {-0.4, -0.41, -0.42}, workspace::VoxelSize(Vector3d(0.011, 0.007, 0.016)), {73, 120, 52}};

TEST(Voxelise, InsideOfABoxAtAnOddAngleIsExact) {
  const Vector3d half(0.15, 0.09, 0.21);
  const auto solid = solid_of(geometry::make_box(2 * half).transformed(crooked()));
  EXPECT_TRUE(solid.report.closed);
  const Pose to_box = crooked().inverse();
  twin::for_each(kAll, [&](workspace::Index3 v) {
    const Vector3d p = to_box * kGrid.centre_of(v);
    const double depth = (half - p.cwiseAbs()).minCoeff();
    if (std::abs(depth) > 2e-6) {
      EXPECT_EQ(twin::is_inside(solid, v), depth > 0);
    }
  });
}

TEST(Voxelise, VolumesAreRightWithinOneShell) {
  const double pi = std::numbers::pi;
  const struct {
    TriangleMesh mesh;
    double volume_m3, area_m2;
  } bodies[] = {{geometry::make_sphere(0.25, 5), 4 / 3.0 * pi * 0.25 * 0.25 * 0.25, 4 * pi * 0.25 * 0.25},
                {geometry::make_box({0.3, 0.2, 0.4}), 0.024, 2 * (0.06 + 0.12 + 0.08)},
                {geometry::make_torus(0.22, 0.08, 128, 64), 2 * pi * pi * 0.22 * 0.08 * 0.08,
                 4 * pi * pi * 0.22 * 0.08}};
  const double voxel_m3 = kGrid.voxel_size_m.sides_m().prod();
  for (const auto& body : bodies) {
    const auto solid = solid_of(body.mesh.transformed(crooked()));
    const double inside_m3 = static_cast<double>(solid.inside.count()) * voxel_m3;
    EXPECT_NEAR(inside_m3 / body.volume_m3, 1.0, 0.01);
    const double shell_m3 = body.area_m2 * kGrid.voxel_size_m.reference_m();
    const double interior_m3 = static_cast<double>(solid.interior().count()) * voxel_m3;
    const double all_m3 = interior_m3 + static_cast<double>(solid.boundary.count()) * voxel_m3;
    EXPECT_LT(body.volume_m3, all_m3);
    EXPECT_GT(body.volume_m3 + shell_m3, all_m3);
    EXPECT_GT(body.volume_m3, interior_m3);
    EXPECT_LT(body.volume_m3 - shell_m3, interior_m3);
  }
}

TEST(Voxelise, BoundaryIsEveryVoxelThatATrianglePasses) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(-0.25, 0.25), reach(-1, 1);
  for (int round = 0; round < 300; ++round) {
    const workspace::GridSpec& grid = round < 150 ? kGrid : kFlatGrid;
    const double extent = round % 3 == 0 ? 0.006 : round % 3 == 1 ? 0.04 : 0.2;
    const Vector3d centre(place(random), place(random), place(random));
    std::array<Vector3d, 3> corners;
    TriangleMesh mesh;
    for (auto& corner : corners) {
      mesh.vertices_m.push_back(
          (centre + extent * Vector3d(reach(random), reach(random), reach(random))).cast<float>());
      corner = mesh.vertices_m.back().cast<double>();
    }
    mesh.triangles = {{0, 1, 2}};
    const workspace::VoxelBox all = workspace::VoxelBox::of(grid);
    const auto solid = solid_of(mesh, 1, all, grid);
    const double unsure = 2e-6;  // twice what a vertex is moved by rounding, and more
    twin::for_each(solid.box.grown(1).intersection(all), [&](workspace::Index3 v) {
      const Vector3d low = grid.origin_m + grid.voxel_size_m.sides_m().cwiseProduct(Vector3d(v.x, v.y, v.z));
      if (twin::meets_voxel(corners, low, grid.voxel_size_m, -unsure)) {
        EXPECT_TRUE(twin::is_boundary(solid, v));
      }
      if (!twin::meets_voxel(corners, low, grid.voxel_size_m, unsure)) {
        EXPECT_FALSE(twin::is_boundary(solid, v));
      }
    });
  }
}

// Powers of two stretch numbers without rounding: the same body, stretched as the voxels are, must take the
// very same voxels of cubes.
TEST(Voxelise, AStretchedBodyTakesTheSameStretchedVoxels) {
  const TriangleMesh bodies[] = {geometry::make_torus(0.2, 0.06, 24, 12).transformed(crooked()),
                                 geometry::make_box({0.3, 0.002, 0.2}).transformed(crooked()),
                                 geometry::make_cylinder(0.1, 0.2, 32).transformed(crooked())};
  for (const TriangleMesh& body : bodies) {
    const SolidVoxels expected = solid_of(body);
    EXPECT_GT(expected.boundary.count(), 1000U);
    for (const Vector3d& stretch : {Vector3d(1, 1, 2), Vector3d(4, 1, 2), Vector3d(0.5, 4, 1)}) {
      TriangleMesh stretched = body;
      for (auto& vertex : stretched.vertices_m) vertex = vertex.cwiseProduct(stretch.cast<float>());
      const workspace::GridSpec grid{
          kGrid.origin_m.cwiseProduct(stretch),
          workspace::VoxelSize(Vector3d(kGrid.voxel_size_m.sides_m().cwiseProduct(stretch))), kGrid.size_vox};
      const SolidVoxels solid = solid_of(stretched, 2, kAll, grid);
      twin::for_each(kAll, [&](workspace::Index3 v) {
        ASSERT_EQ(twin::is_boundary(solid, v), twin::is_boundary(expected, v));
        ASSERT_EQ(twin::is_inside(solid, v), twin::is_inside(expected, v));
      });
    }
  }
}

TEST(Voxelise, ATriangleSmallerThanAVoxelMarksItsVoxel) {
  const Vector3d p = kGrid.centre_of({11, 22, 33}) + Vector3d(0.003, 0.003, -0.002);
  TriangleMesh mesh;
  for (const Vector3d& step : {Vector3d(0, 0, 0), Vector3d(1e-4, 0, 0), Vector3d(0, 1e-4, 1e-4)}) {
    mesh.vertices_m.push_back((p + step).cast<float>());
  }
  mesh.triangles = {{0, 1, 2}};
  const auto solid = solid_of(mesh);
  EXPECT_EQ(solid.boundary.count(), 1U);
  EXPECT_TRUE(twin::is_boundary(solid, {11, 22, 33}));
  EXPECT_EQ(solid.inside.count(), 0U);
}

TEST(Voxelise, NothingLeaksThroughTheBoundary) {
  TriangleMesh bodies[] = {geometry::make_sphere(0.2, 2), geometry::make_torus(0.2, 0.06, 24, 12),
                           geometry::make_box({0.3, 0.004, 0.2}), geometry::make_cylinder(0.1, 0.4, 17)};
  for (const auto& body : bodies) {
    const auto solid = solid_of(body.transformed(crooked()));
    const workspace::VoxelBox around = solid.box.grown(2);
    const auto reached = twin::reached_from_outside(solid, around);
    std::size_t i = 0;
    twin::for_each(around, [&](workspace::Index3 v) {
      EXPECT_FALSE(reached[i] && twin::is_inside(solid, v));
      ++i;
    });
  }
}

TEST(Voxelise, KeepsAPlateThinnerThanAVoxelWithoutAHole) {
  // Nearly axis-aligned, so that its faces cross the voxels' borders at grazing angles; 0.5 mm between 10 mm
  // voxels.
  const Pose X{geometry::rotation_from_rpy(0.002, -0.003, 0.4), {0.001, 0.002, 0.0049}};
  const auto solid = solid_of(geometry::make_box({0.5, 0.5, 0.0005}).transformed(X));
  // Every vertical line through its middle part meets it.
  for (std::int32_t x = 25; x < 55; ++x) {
    for (std::int32_t y = 25; y < 55; ++y) {
      bool met = false;
      for (std::int32_t z = 30; z < 50; ++z) met = met || twin::is_boundary(solid, {x, y, z});
      EXPECT_TRUE(met);
    }
  }
}

TEST(Voxelise, FacesOnVoxelBordersBelongToTheUpperVoxel) {
  const Pose X{Eigen::Matrix3d::Identity(), {0.0, 0.0, 0.0}};
  const workspace::GridSpec grid{{-0.5, -0.5, -0.5}, 0.125, {8, 8, 8}};  // exact in binary
  const auto solid =
      voxelise(geometry::make_box({0.5, 0.5, 0.5}).transformed(X), grid, workspace::VoxelBox::of(grid));
  ASSERT_TRUE(solid);
  twin::for_each(workspace::VoxelBox::of(grid), [&](workspace::Index3 v) {
    const auto within = [](std::int32_t i) { return i >= 2 && i <= 6; };
    const auto on_face = [](std::int32_t i) { return i == 2 || i == 6; };
    const bool expected =
        within(v.x) && within(v.y) && within(v.z) && (on_face(v.x) || on_face(v.y) || on_face(v.z));
    EXPECT_EQ(twin::is_boundary(*solid, v), expected) << v.x << ' ' << v.y << ' ' << v.z;
    const auto in = [](std::int32_t i) { return i >= 2 && i < 6; };
    EXPECT_EQ(twin::is_inside(*solid, v), in(v.x) && in(v.y) && in(v.z));
  });
}

TEST(Voxelise, AnOpenTubeIsStillSolid) {
  TriangleMesh tube = geometry::make_box({0.2, 0.2, 0.4}).transformed(crooked());
  const auto whole = solid_of(tube);
  tube.triangles.erase(tube.triangles.begin(), tube.triangles.begin() + 4);  // both ends
  const auto open = solid_of(tube);
  EXPECT_GT(open.inside.count(), whole.inside.count() / 2);
  for (std::size_t i = 0; i < open.inside.words().size() && open.box.size == whole.box.size; ++i) {
    EXPECT_EQ(open.inside.words()[i] & ~whole.inside.words()[i], 0U);
  }
}

TEST(Voxelise, ClippingDoesNotChangeWhatIsLeft) {
  const TriangleMesh mesh = geometry::make_torus(0.22, 0.1, 40, 20).transformed(crooked());
  const workspace::VoxelBox clip{{35, 30, 38}, {9, 20, 3}};
  const auto whole = solid_of(mesh), part = solid_of(mesh, 1, clip);
  twin::for_each(clip, [&](workspace::Index3 v) {
    EXPECT_EQ(twin::is_inside(part, v), twin::is_inside(whole, v));
    EXPECT_EQ(twin::is_boundary(part, v), twin::is_boundary(whole, v));
  });
}

TEST(Voxelise, WhatLiesElsewhereIsEmpty) {
  const auto solid =
      solid_of(geometry::make_sphere(0.1, 2).transformed({Eigen::Matrix3d::Identity(), {5, 0, 0}}));
  EXPECT_TRUE(solid.box.empty());
  EXPECT_FALSE(voxelise(geometry::make_sphere(500, 2), kGrid, kAll));
  EXPECT_FALSE(voxelise(geometry::make_sphere(1e8, 2), kGrid, kAll));
  EXPECT_TRUE(solid_of(TriangleMesh{}).box.empty());
}

/// Triangles anywhere in a box of `half_m`, each alone, with edges of about `edge_m`.
TriangleMesh soup(std::size_t count, double half_m, double edge_m) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> place(static_cast<float>(-half_m), static_cast<float>(half_m)),
      reach(static_cast<float>(-edge_m), static_cast<float>(edge_m));
  TriangleMesh mesh;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Eigen::Vector3f at(place(random), place(random), place(random));
    for (int corner = 0; corner < 3; ++corner)
      mesh.vertices_m.push_back(at + Eigen::Vector3f(reach(random), reach(random), reach(random)));
    mesh.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  return mesh;
}

// Before anything is marked: what crosses takes 4 octets a line and triangle, besides its time.
TEST(Voxelise, ManyLargeTrianglesAreRefusedByTheBudgetAtOnce) {
  const TriangleMesh mesh = soup(2000, 0.2, 0.1);
  core::WorkBudget little(100'000), enough;
  const auto refused = voxelise(mesh, kGrid, kAll, {.budget = &little});
  EXPECT_EQ(refused.status().code(), core::ErrorCode::kResourceExhausted);
  EXPECT_NE(refused.status().message().find("voxelising takes more than"), std::string::npos);
  ASSERT_TRUE(voxelise(mesh, kGrid, kAll, {.budget = &enough}));
  // Literally: each line along each axis that a triangle's box reaches over, eight steps.
  std::uint64_t lines = 0;
  for (const auto& corners : mesh.triangles) {
    geometry::BoundingBox box;
    for (const std::uint32_t corner : corners) box.extend(mesh.vertices_m[corner]);
    const auto voxels = voxel_bounds(box, kGrid).grown(-1).intersection(kAll);
    for (std::size_t axis = 0; axis < 3; ++axis)
      lines += static_cast<std::uint64_t>(voxels.size[(axis + 1) % 3]) *
               static_cast<std::uint64_t>(voxels.size[(axis + 2) % 3]);
  }
  EXPECT_GT(enough.spent(), 8 * lines * 9 / 10);
  EXPECT_LT(little.spent(), 8 * lines) << "one axis of three was counted when it ended";
}

}  // namespace
}  // namespace phantom::voxelise
