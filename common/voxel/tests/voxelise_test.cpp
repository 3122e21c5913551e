#include "common/voxel/voxelise.hpp"

#include <gtest/gtest.h>

#include <numbers>
#include <random>

#include "common/geometry/primitives.hpp"
#include "common/voxel/tests/literal_twins.hpp"

namespace phantom::voxel {
namespace {

using Eigen::Vector3d;
using geometry::Pose;
using geometry::TriangleMesh;

const GridSpec kGrid{{-0.4, -0.4, -0.4}, 0.01, {80, 80, 80}};
const VoxelBox kAll = VoxelBox::of(kGrid);

SolidVoxels solid_of(const TriangleMesh& mesh, const VoxelBox& clip = kAll) {
  auto solid = voxelise(mesh, kGrid, clip);
  EXPECT_TRUE(solid) << solid.status().message();
  return std::move(*solid);
}

Pose crooked() { return {geometry::rotation_from_rpy(0.31, -0.72, 1.13), {0.0123, -0.0231, 0.0077}}; }

TEST(Voxelise, InsideOfABoxAtAnOddAngleIsExact) {
  const Vector3d half(0.15, 0.09, 0.21);
  const auto solid = solid_of(geometry::make_box(2 * half).transformed(crooked()));
  EXPECT_TRUE(solid.report.closed);
  const Pose to_box = crooked().inverse();
  twin::for_each(kAll, [&](Index3 v) {
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
  const double voxel_m3 = std::pow(kGrid.voxel_size_m, 3);
  for (const auto& body : bodies) {
    const auto solid = solid_of(body.mesh.transformed(crooked()));
    const double inside_m3 = static_cast<double>(solid.inside.count()) * voxel_m3;
    EXPECT_NEAR(inside_m3 / body.volume_m3, 1.0, 0.01);
    const double shell_m3 = body.area_m2 * kGrid.voxel_size_m;
    const double interior_m3 = static_cast<double>(solid.interior.count()) * voxel_m3;
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
  for (int round = 0; round < 150; ++round) {
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
    const auto solid = solid_of(mesh);
    const double unsure = 2e-6;  // twice what a vertex is moved by rounding, and more
    twin::for_each(solid.box.grown(1).intersection(kAll), [&](Index3 v) {
      const Vector3d low = kGrid.origin_m + kGrid.voxel_size_m * Vector3d(v.x, v.y, v.z);
      if (twin::meets_cube(corners, low, kGrid.voxel_size_m, -unsure)) {
        EXPECT_TRUE(twin::is_boundary(solid, v));
      }
      if (!twin::meets_cube(corners, low, kGrid.voxel_size_m, unsure)) {
        EXPECT_FALSE(twin::is_boundary(solid, v));
      }
    });
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
    const VoxelBox around = solid.box.grown(2);
    const auto reached = twin::reached_from_outside(solid, around);
    std::size_t i = 0;
    twin::for_each(around, [&](Index3 v) {
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
  const GridSpec grid{{-0.5, -0.5, -0.5}, 0.125, {8, 8, 8}};  // exact in binary
  const auto solid = voxelise(geometry::make_box({0.5, 0.5, 0.5}).transformed(X), grid, VoxelBox::of(grid));
  ASSERT_TRUE(solid);
  twin::for_each(VoxelBox::of(grid), [&](Index3 v) {
    const auto within = [](std::int32_t i) { return i >= 2 && i <= 6; };
    const auto on_face = [](std::int32_t i) { return i == 2 || i == 6; };
    const bool expected =
        within(v.x) && within(v.y) && within(v.z) && (on_face(v.x) || on_face(v.y) || on_face(v.z));
    EXPECT_EQ(twin::is_boundary(*solid, v), expected) << v.x << ' ' << v.y << ' ' << v.z;
    const auto in = [](std::int32_t i) { return i >= 2 && i < 6; };
    EXPECT_EQ(twin::is_inside(*solid, v), in(v.x) && in(v.y) && in(v.z));
  });
}

TEST(Voxelise, CommutesWithTranslationByWholeVoxels) {
  const TriangleMesh mesh = geometry::make_torus(0.15, 0.05, 20, 10).transformed(crooked());
  const GridSpec moved{kGrid.origin_m - 0.01 * Vector3d(5, -3, 7), 0.01, {80, 80, 80}};
  const auto here = solid_of(mesh);
  const auto there = voxelise(mesh, moved, VoxelBox::of(moved));
  ASSERT_TRUE(there);
  twin::for_each(kAll, [&](Index3 v) {
    const Index3 w{v.x + 5, v.y - 3, v.z + 7};
    EXPECT_EQ(twin::is_inside(here, v), twin::is_inside(*there, w));
    EXPECT_EQ(twin::is_boundary(here, v), twin::is_boundary(*there, w));
  });
}

TEST(Voxelise, CommutesWithQuarterTurns) {
  const TriangleMesh mesh = geometry::make_torus(0.15, 0.05, 20, 10).transformed(crooked());
  TriangleMesh turned = mesh;  // (x, y, z) → (y, z, x): exact in any arithmetic
  for (auto& v : turned.vertices_m) v = Eigen::Vector3f(v.y(), v.z(), v.x());
  TriangleMesh quarter = mesh;  // (x, y, z) → (−y, x, z)
  for (auto& v : quarter.vertices_m) v = Eigen::Vector3f(-v.y(), v.x(), v.z());
  const auto a = solid_of(mesh), b = solid_of(turned), c = solid_of(quarter);
  twin::for_each(kAll, [&](Index3 v) {
    EXPECT_EQ(twin::is_inside(a, v), twin::is_inside(b, {v.y, v.z, v.x}));
    EXPECT_EQ(twin::is_boundary(a, v), twin::is_boundary(b, {v.y, v.z, v.x}));
    EXPECT_EQ(twin::is_inside(a, v), twin::is_inside(c, {79 - v.y, v.x, v.z}));
    EXPECT_EQ(twin::is_boundary(a, v), twin::is_boundary(c, {79 - v.y, v.x, v.z}));
  });
}

void expect_same(const SolidVoxels& a, const SolidVoxels& b) {
  EXPECT_EQ(a.inside.words(), b.inside.words());
  EXPECT_EQ(a.boundary.words(), b.boundary.words());
}

TEST(Voxelise, DoesNotCareWhichWayTrianglesFace) {
  const TriangleMesh mesh = geometry::make_sphere(0.2, 3).transformed(crooked());
  TriangleMesh mixed = mesh;
  for (std::size_t i = 0; i < mixed.triangles.size(); i += 3)
    std::swap(mixed.triangles[i][1], mixed.triangles[i][2]);
  expect_same(solid_of(mesh), solid_of(mixed));
}

TEST(Voxelise, DoesNotCountATriangleTwice) {
  const TriangleMesh mesh = geometry::make_sphere(0.2, 3).transformed(crooked());
  TriangleMesh doubled = mesh;
  for (std::size_t i = 0; i < 100; ++i) {
    const auto& t = mesh.triangles[7 * i];
    doubled.triangles.push_back({t[1], t[2], t[0]});
  }
  const auto solid = solid_of(doubled);
  EXPECT_EQ(solid.report.duplicate_triangles, 100U);
  EXPECT_TRUE(solid.report.closed);
  expect_same(solid, solid_of(mesh));
}

TEST(Voxelise, AHoleInTheMeshDoesNotFloodTheOutside) {
  const TriangleMesh mesh = geometry::make_sphere(0.2, 3).transformed(crooked());
  TriangleMesh open = mesh;
  for (int i = 0; i < 30; ++i) open.triangles.erase(open.triangles.begin() + 17 * i);
  const auto whole = solid_of(mesh), holed = solid_of(open);
  EXPECT_FALSE(holed.report.closed);
  EXPECT_GT(holed.report.disputed_voxels, 0U);
  std::size_t wrong = 0;
  twin::for_each(kAll, [&](Index3 v) {
    if (twin::is_inside(holed, v)) {
      EXPECT_TRUE(twin::is_solid(whole, v));
    }
    wrong += twin::is_inside(holed, v) != twin::is_inside(whole, v) ? 1 : 0;
  });
  EXPECT_LT(wrong, whole.inside.count() / 20);
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
  const VoxelBox clip{{35, 30, 38}, {9, 20, 3}};
  const auto whole = solid_of(mesh), part = solid_of(mesh, clip);
  twin::for_each(clip, [&](Index3 v) {
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

}  // namespace
}  // namespace phantom::voxel
