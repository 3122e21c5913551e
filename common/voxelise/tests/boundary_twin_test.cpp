#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/voxelise/tests/literal_twins.hpp"
#include "common/voxelise/voxelise.hpp"

// The boundary against its literal statement: a closed triangle and a closed voxel meet unless one of
// thirteen directions separates them, in whole numbers of 1/16384 voxel.

namespace phantom::voxelise {
namespace {

__extension__ using Wide = __int128;
using Point = std::array<std::int64_t, 3>;  // 1/kSub voxel
constexpr std::int64_t kSub = 16384;

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
std::array<Wide, 3> cross(const Point& a, const Point& b) {
  return {Wide{a[1]} * b[2] - Wide{a[2]} * b[1], Wide{a[2]} * b[0] - Wide{a[0]} * b[2],
          Wide{a[0]} * b[1] - Wide{a[1]} * b[0]};
}

bool separated(const std::array<Wide, 3>& direction, const std::array<Point, 3>& t, const Point& low) {
  const auto along = [&](const Point& p) {
    return direction[0] * p[0] + direction[1] * p[1] + direction[2] * p[2];
  };
  Wide t_min = along(t[0]), t_max = t_min, cube_min = along(low), cube_max = cube_min;
  for (const Point& p : t) {
    t_min = std::min(t_min, along(p));
    t_max = std::max(t_max, along(p));
  }
  for (int corner = 0; corner < 8; ++corner) {
    const Wide value = along(
        {low[0] + (corner & 1) * kSub, low[1] + (corner >> 1 & 1) * kSub, low[2] + (corner >> 2) * kSub});
    cube_min = std::min(cube_min, value);
    cube_max = std::max(cube_max, value);
  }
  return t_max < cube_min || cube_max < t_min;
}

bool meets(const std::array<Point, 3>& t, workspace::Index3 v) {
  const Point low{v.x * kSub, v.y * kSub, v.z * kSub};
  for (std::size_t axis = 0; axis < 3; ++axis) {  // floor() names the voxels at either end
    const auto [first, last] = std::minmax({t[0][axis], t[1][axis], t[2][axis]});
    if ((first >> 14) * kSub > low[axis] || (last >> 14) * kSub < low[axis]) return false;
  }
  const Point edges[3] = {minus(t[1], t[0]), minus(t[2], t[1]), minus(t[0], t[2])};
  if (separated(cross(edges[0], edges[1]), t, low)) return false;
  for (const Point& edge : edges) {
    for (const Point& axis : {Point{1, 0, 0}, Point{0, 1, 0}, Point{0, 0, 1}}) {
      if (separated(cross(edge, axis), t, low)) return false;
    }
  }
  return true;
}

// One voxel is 1 m, so that whole numbers of 1/16384 voxel are exact in float.
workspace::GridSpec unit_grid(std::int32_t edge) { return {{0, 0, 0}, 1.0, {edge, edge, edge}}; }

geometry::TriangleMesh mesh_of(const std::vector<std::array<Point, 3>>& triangles) {
  geometry::TriangleMesh mesh;
  for (const auto& t : triangles) {
    const auto first = static_cast<std::uint32_t>(mesh.vertices_m.size());
    for (const Point& p : t)
      mesh.vertices_m.emplace_back(static_cast<float>(p[0]) / kSub, static_cast<float>(p[1]) / kSub,
                                   static_cast<float>(p[2]) / kSub);
    mesh.triangles.push_back({first, first + 1, first + 2});
  }
  return mesh;
}

/// `compared`: voxels of the grid.
void expect_as_twin(const std::vector<std::array<Point, 3>>& triangles, const workspace::GridSpec& grid,
                    const workspace::VoxelBox& compared) {
  const auto solid = voxelise(mesh_of(triangles), grid, workspace::VoxelBox::of(grid));
  ASSERT_TRUE(solid) << solid.status().message();
  std::size_t wrong = 0;
  twin::for_each(compared, [&](workspace::Index3 v) {
    const bool expected =
        std::any_of(triangles.begin(), triangles.end(), [&](const auto& t) { return meets(t, v); });
    wrong += expected != twin::is_boundary(*solid, v) ? 1 : 0;
  });
  EXPECT_EQ(wrong, 0U);
}
void expect_as_twin(const std::vector<std::array<Point, 3>>& triangles, std::int32_t edge) {
  expect_as_twin(triangles, unit_grid(edge), workspace::VoxelBox::of(unit_grid(edge)));
}

TEST(BoundaryTwin, RandomTrianglesOfAllSizes) {
  std::mt19937 random(1);
  const std::int32_t edge = 24;
  for (int round = 0; round < 300; ++round) {
    const std::int64_t extents[] = {kSub / 4, kSub, 3 * kSub, 9 * kSub, 60 * kSub};
    const std::int64_t extent = extents[round % 5];
    // Now and then all coordinates are whole or half voxels: edges and planes through voxel corners.
    const std::int64_t step = round % 3 == 0 ? kSub : round % 3 == 1 ? kSub / 2 : 1;
    std::array<Point, 3> t;
    Point centre;
    for (auto& c : centre) c = static_cast<std::int64_t>(random() % (edge * kSub));
    for (Point& p : t) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto offset = static_cast<std::int64_t>(random() % (2 * extent)) - extent;
        // Floats hold 24 bits: farther out only multiples of 64 are exact.
        const std::int64_t grain = std::max<std::int64_t>(step, 64);
        p[axis] = (centre[axis] + offset) / grain * grain;
      }
    }
    expect_as_twin({t}, edge);
  }
}

/// Large ones among them, and some that reach beyond the grid; whole and half voxels as above.
std::vector<std::array<Point, 3>> many_small_triangles(int round, std::int32_t edge, std::mt19937& random) {
  const std::int64_t grain = round % 3 == 0 ? kSub : round % 3 == 1 ? kSub / 2 : 1;
  std::vector<std::array<Point, 3>> triangles(20 + random() % 40);
  for (auto& t : triangles) {
    const std::int64_t extents[] = {kSub / 3, kSub / 3, kSub, kSub, 2 * kSub, 3 * kSub, 5 * kSub};
    const std::int64_t extent = extents[random() % std::size(extents)];
    Point centre;
    for (auto& c : centre)
      c = static_cast<std::int64_t>(random() % static_cast<std::uint64_t>((edge + 2) * kSub)) - kSub;
    for (Point& p : t) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        p[axis] = (centre[axis] +
                   static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(2 * extent)) - extent) /
                  grain * grain;
    }
    if (random() % 8 == 0) t[2] = t[1];
    const auto flat = static_cast<std::size_t>(round % 3);
    if (random() % 8 == 0) t[0][flat] = t[1][flat] = t[2][flat];
  }
  return triangles;
}

TEST(BoundaryTwin, ManySmallTrianglesAtOnceWithEveryInstructionSet) {
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    SCOPED_TRACE(hwy::TargetName(target));
    std::mt19937 random(4);
    for (int round = 0; round < 40; ++round) expect_as_twin(many_small_triangles(round, 12, random), 12);
  }
  hwy::SetSupportedTargetsForTest(0);
}

TEST(BoundaryTwin, ManySmallTrianglesWhereWordsOfVoxelsEnd) {
  constexpr std::int32_t kEdge = 8, kFrom = 60;  // of 64 voxels a word
  const workspace::GridSpec grid{{0, 0, 0}, 1.0, {kFrom + kEdge, kEdge, kEdge}};
  std::mt19937 random(5);
  for (int round = 0; round < 60; ++round) {
    auto triangles = many_small_triangles(round, kEdge, random);
    for (auto& t : triangles) {
      for (Point& p : t) p[0] += kFrom * kSub;
    }
    triangles.push_back({Point{0, 0, 0}, Point{kSub, 0, 0}, Point{0, kSub, 0}});  // where rows begin
    expect_as_twin(triangles, grid, {{kFrom, 0, 0}, {kEdge, kEdge, kEdge}});
  }
}

TEST(BoundaryTwin, SliversAndSegmentsAndPoints) {
  std::mt19937 random(2);
  for (int round = 0; round < 100; ++round) {
    std::array<Point, 3> t;
    for (Point& p : t) {
      for (auto& c : p) c = static_cast<std::int64_t>(random() % (20 * kSub)) / 64 * 64;
    }
    if (round % 4 == 0) t[2] = t[1];                              // a segment
    if (round % 4 == 1) t[2] = t[1] = t[0];                       // a point
    if (round % 4 == 2) t[2] = {t[1][0] + 64, t[1][1], t[1][2]};  // a sliver
    if (round % 4 == 3) t[0][2] = t[1][2] = t[2][2] = 7 * kSub;   // on the border of a layer
    expect_as_twin({t}, 20);
  }
}

TEST(BoundaryTwin, TrianglesMuchLargerThanTheGrid) {
  // Products that no double holds: doubtful voxels are decided in whole numbers.
  std::mt19937 random(3);
  for (int round = 0; round < 40; ++round) {
    std::array<Point, 3> t;
    for (Point& p : t) {
      for (auto& c : p) c = (static_cast<std::int64_t>(random() % 12001) - 6000) * kSub;
    }
    // Shifted so that the plane passes through the grid, and on every other round right through a voxel
    // corner.
    const Point middle{(t[0][0] + t[1][0] + t[2][0]) / 3, (t[0][1] + t[1][1] + t[2][1]) / 3,
                       (t[0][2] + t[1][2] + t[2][2]) / 3};
    for (Point& p : t) {
      for (std::size_t axis = 0; axis < 3; ++axis)
        p[axis] = (p[axis] - middle[axis]) / kSub * kSub + 8 * kSub + (round % 2 == 0 ? 0 : kSub / 2);
    }
    expect_as_twin({t}, 16);
  }
}

TEST(BoundaryTwin, WholeMeshes) {
  for (const auto& body : {geometry::make_sphere(9, 2), geometry::make_torus(7, 2.5, 16, 8),
                           geometry::make_box({14, 11, 0.01})}) {
    const geometry::TriangleMesh mesh =
        body.transformed({geometry::rotation_from_rpy(0.3, -0.5, 1.1), {12.3, 11.7, 12.1}});
    std::vector<std::array<Point, 3>> triangles;
    for (const auto& t : mesh.triangles) {
      std::array<Point, 3> snapped;
      for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t axis = 0; axis < 3; ++axis)
          snapped[k][axis] =
              std::llround(mesh.vertices_m[t[k]][static_cast<Eigen::Index>(axis)] * 1024.0) * 16;
      }
      triangles.push_back(snapped);
    }
    expect_as_twin(triangles, 24);
  }
}

}  // namespace
}  // namespace phantom::voxelise
