#include <gmock/gmock.h>

#include <Eigen/Geometry>
#include <algorithm>

#include "common/core/units.hpp"
#include "common/geometry/implicit/primitives.hpp"
#include "common/survey/tests/survey_rig.hpp"

namespace phantom::survey {
namespace {

std::vector<double> sorted_edges(const BorderLoop& loop) {
  auto edges = loop.edge_m;
  std::sort(edges.begin(), edges.end());
  return edges;
}

TEST(PartModel, ABoxHasSixFacesOfFourCorners) {
  const PartModel box = make_part("box", geometry::make_box({0.3, 0.2, 0.1}));
  EXPECT_EQ(box.faces.size(), 6u);
  EXPECT_EQ(box.nodes_O_m.size(), 8u);
  ASSERT_EQ(box.loops.size(), 6u);
  double area_m2 = 0.0;
  for (const BorderLoop& loop : box.loops) {
    EXPECT_EQ(loop.nodes.size(), 4u);
    for (const double turn : loop.turn_rad) EXPECT_NEAR(turn, 90 * core::kRadPerDegree, 1e-6);
    area_m2 += box.faces[loop.face].area_m2;
  }
  EXPECT_NEAR(area_m2, 0.22, 1e-6);
  EXPECT_EQ(box.extremes_O_m.size(), 8u);
}

TEST(PartModel, EveryShippedPartsBordersTurnOnceAndItsAreaIsThatOfItsMesh) {
  for (const PartModel& part : shipped_library()) {
    EXPECT_GE(part.loops.size(), 5u) << part.name;
    double faces_m2 = 0.0, mesh_m2 = 0.0;
    for (const PartFace& face : part.faces) faces_m2 += face.area_m2;
    for (const auto& t : part.mesh_O.triangles) {
      const auto& v = part.mesh_O.vertices_m;
      mesh_m2 += 0.5 * (v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]).cast<double>().norm();
    }
    EXPECT_NEAR(faces_m2, mesh_m2, 1e-6 * mesh_m2) << part.name;
    for (const BorderLoop& loop : part.loops) {
      double turn = 0.0;
      for (const double t : loop.turn_rad) turn += t;
      EXPECT_NEAR(turn, 2 * std::numbers::pi, 1e-4) << part.name;
      EXPECT_TRUE(!loop.hole || part.name == "vice");
    }
  }
  EXPECT_EQ(part_named("v_groove_block").loops.size(), 9u);
  EXPECT_EQ(part_named("v_groove_block").nodes_O_m.size(), 14u);
}

TEST(PartModel, DuplicateVerticesDegenerateTrianglesAndTJunctionsChangeNothing) {
  const geometry::TriangleMesh box = geometry::make_box({0.3, 0.2, 0.1});
  geometry::TriangleMesh
      soup;  // three vertices of its own for each triangle, some off by rounding, one edge split
  for (std::size_t i = 0; i < box.triangles.size(); ++i) {
    const auto base = static_cast<std::uint32_t>(soup.vertices_m.size());
    for (const std::uint32_t v : box.triangles[i])
      soup.vertices_m.push_back(box.vertices_m[v] +
                                Eigen::Vector3f::Constant(1e-7F * static_cast<float>(i % 3)));
    if (i == 0) {
      soup.vertices_m.push_back(0.5F * (soup.vertices_m[base] + soup.vertices_m[base + 1]));
      soup.triangles.push_back({base, base + 3, base + 2});
      soup.triangles.push_back({base + 3, base + 1, base + 2});
    } else {
      soup.triangles.push_back({base, base + 1, base + 2});
    }
    soup.triangles.push_back({base, base, base + 1});
    soup.triangles.push_back(soup.triangles[soup.triangles.size() - 2]);  // twice
  }
  const PartModel part = make_part("soup", soup);
  EXPECT_EQ(part.faces.size(), 6u);
  EXPECT_EQ(part.loops.size(), 6u);
  EXPECT_EQ(part.nodes_O_m.size(), 8u);
  for (const BorderLoop& loop : part.loops) EXPECT_EQ(loop.nodes.size(), 4u);
}

TEST(PartModel, AHoleIsABorderOfItsOwnAndFacetsOfACurveAreFacesOfTheirOwn) {
  // A square plate with a square hole: a frame of eight triangles on top.
  geometry::TriangleMesh frame;
  for (const float s : {0.1F, 0.05F}) {
    for (const auto& [x, y] : {std::pair{-s, -s}, {s, -s}, {s, s}, {-s, s}})
      frame.vertices_m.emplace_back(x, y, 0.0F);
  }
  for (std::uint32_t i = 0; i < 4; ++i) {
    const std::uint32_t j = (i + 1) % 4;
    frame.triangles.push_back({i, j, 4 + j});
    frame.triangles.push_back({i, 4 + j, 4 + i});
  }
  const PartModel part = make_part("frame", frame);
  ASSERT_EQ(part.faces.size(), 1u);
  ASSERT_EQ(part.loops.size(), 2u);
  EXPECT_EQ(std::count_if(part.loops.begin(), part.loops.end(), [](const auto& loop) { return loop.hole; }),
            1);
  for (const BorderLoop& loop : part.loops) EXPECT_NEAR(sorted_edges(loop)[0], loop.hole ? 0.1 : 0.2, 1e-6);
  const PartModel drum = make_part("drum", geometry::make_cylinder(0.1, 0.2, 48));
  EXPECT_EQ(drum.faces.size(), 50u) << "48 facets and two ends";
}

TEST(PartModel, SymmetriesAreThoseOfTheShape) {
  const auto about_z = [](const Eigen::Vector3d& centre, double deg) {
    geometry::Pose X;
    X.rotation = geometry::rotation_about(Eigen::Vector3d::UnitZ(), deg * core::kRadPerDegree);
    X.translation_m = centre - X.rotation * centre;
    return X;
  };
  EXPECT_TRUE(is_symmetry(part_named("cube"), about_z({0.06, 0.06, 0}, 90)));
  EXPECT_FALSE(is_symmetry(part_named("cube"), about_z({0.06, 0.06, 0}, 45)));
  EXPECT_TRUE(is_symmetry(part_named("brick"), about_z({0.1, 0.05, 0}, 180)));
  EXPECT_FALSE(is_symmetry(part_named("brick"), about_z({0.1, 0.05, 0}, 90)));
  EXPECT_TRUE(is_symmetry(part_named("hexagon"), about_z({0, 0, 0}, 60)));
  EXPECT_FALSE(is_symmetry(part_named("v_groove_block"), about_z({0.07, 0.045, 0}, 180)));
}

}  // namespace
}  // namespace phantom::survey
