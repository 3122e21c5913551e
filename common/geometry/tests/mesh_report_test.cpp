#include "common/geometry/mesh/mesh_report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/mesh/triangle_pairs.hpp"
#include "common/geometry/mesh/winding_number.hpp"

namespace phantom::geometry {
namespace {

using Eigen::Vector3d;

TriangleMesh moved(const TriangleMesh& mesh, const Vector3d& by) {
  return mesh.transformed({rotation_from_rpy(0.3, -0.7, 1.1), by});
}

TEST(MeshReport, OfFlawlessMeshes) {
  for (const auto& mesh : {make_box({0.2, 0.3, 0.4}), make_sphere(0.5, 3), make_torus(0.5, 0.2, 30, 20)}) {
    const MeshReport report = inspect_mesh(moved(mesh, {1, 2, 3}));
    EXPECT_TRUE(report.flawless());
    EXPECT_TRUE(describe(report).empty());
    EXPECT_EQ(report.shells, 1U);
    EXPECT_EQ(report.closed_shells, 1U);
    EXPECT_EQ(report.inward_shells, 0U);
    EXPECT_NEAR(report.volume_m3, enclosed_volume_m3(mesh), 1e-5);
  }
  EXPECT_NEAR(inspect_mesh(make_box({0.2, 0.3, 0.4})).area_m2, 2 * (0.06 + 0.08 + 0.12), 1e-6);
  EXPECT_FALSE(inspect_mesh({}).flawless());
}

TEST(MeshReport, CountsEachDefect) {
  TriangleMesh mesh = make_sphere(0.5, 3);
  mesh.append(moved(make_sphere(0.1, 2), {3, 0, 0}));
  const std::size_t n = mesh.triangles.size();
  mesh.triangles.push_back(mesh.triangles[7]);  // twice
  mesh.triangles.push_back(
      {mesh.triangles[9][0], mesh.triangles[9][2], mesh.triangles[9][1]});  // and its back
  mesh.triangles.push_back({4, 4, 5});                                      // no extent
  for (std::size_t i : {20U, 40U, 60U}) std::swap(mesh.triangles[i][0], mesh.triangles[i][1]);
  mesh.triangles.erase(mesh.triangles.begin() + 100);  // a hole
  const MeshReport report = inspect_mesh(mesh);
  EXPECT_EQ(report.triangles, n + 2);
  EXPECT_EQ(report.duplicate_triangles, 2U);
  EXPECT_EQ(report.degenerate_triangles, 1U);
  EXPECT_EQ(report.flipped_triangles, 3U);
  EXPECT_EQ(report.open_edges, 3U);
  EXPECT_EQ(report.non_manifold_edges, 0U);
  EXPECT_EQ(report.shells, 2U);
  EXPECT_EQ(report.closed_shells, 1U);
  EXPECT_EQ(report.intersecting_pairs, 0U);
  EXPECT_THAT(describe(report),
              ::testing::ElementsAre("has 3 open edges", "has 3 triangles that face the wrong way",
                                     "has 2 triangles twice", "has 1 triangle without area"));
}

TEST(MeshReport, FindsEdgesOfMoreThanTwoTriangles) {
  // Three leaves on one edge.
  const TriangleMesh leaves{{{0, 0, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {-1, -1, 0}},
                            {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}}};
  const MeshReport report = inspect_mesh(leaves);
  EXPECT_EQ(report.non_manifold_edges, 1U);
  EXPECT_EQ(report.open_edges, 6U);
  EXPECT_EQ(report.shells, 3U);
}

TEST(MeshReport, FindsCavitiesAndBodiesInsideOut) {
  TriangleMesh hollow = make_sphere(0.5, 3), core = make_sphere(0.2, 2);
  for (auto& t : core.triangles) std::swap(t[0], t[1]);
  hollow.append(core);
  const MeshReport report = inspect_mesh(hollow);
  EXPECT_EQ(report.inward_shells, 1U);
  EXPECT_EQ(report.flipped_triangles, 0U);
  EXPECT_TRUE(report.flawless());
  EXPECT_NEAR(report.volume_m3,
              enclosed_volume_m3(make_sphere(0.5, 3)) - enclosed_volume_m3(make_sphere(0.2, 2)), 1e-6);
}

/// The sum of shells of which it is known where they lie, however their triangles are turned and repeated.
TEST(MeshReport, TakesTheVolumeOfWhatIsSolidWhateverIsRepeatedOrTurned) {
  const TriangleMesh ball = make_sphere(0.5, 3), hollow = make_sphere(0.3, 2),
                     core = make_box({0.1, 0.1, 0.1}), apart = moved(make_box({0.2, 0.3, 0.4}), {2, 0, 0});
  const auto inside_out = [](TriangleMesh mesh) {
    for (auto& t : mesh.triangles) std::swap(t[0], t[1]);
    return mesh;
  };
  const double solid_m3 = enclosed_volume_m3(ball) - enclosed_volume_m3(hollow) + enclosed_volume_m3(core) +
                          enclosed_volume_m3(apart);
  std::mt19937 random(5);
  for (int round = 0; round < 20; ++round) {
    TriangleMesh mesh = ball;
    mesh.append(inside_out(hollow));
    mesh.append(core);
    mesh.append(round % 2 == 0 ? apart : inside_out(apart));  // a body inside out is solid, too
    std::vector<std::array<std::uint32_t, 3>> more;
    for (auto& t : mesh.triangles) {
      if (random() % 10 == 0) more.push_back(t);
      if (random() % 10 == 0) std::swap(t[1], t[2]);
      if (random() % 20 == 0) more.push_back({t[1], t[2], t[0]});
    }
    mesh.triangles.insert(mesh.triangles.end(), more.begin(), more.end());
    std::shuffle(mesh.triangles.begin(), mesh.triangles.end(), random);
    const MeshReport report = inspect_mesh(mesh);
    EXPECT_GT(report.duplicate_triangles, 0U);
    EXPECT_NEAR(report.volume_m3, solid_m3, 1e-6) << round;
  }
  TriangleMesh twice = ball;  // a body inside a body adds nothing
  twice.append(core);
  EXPECT_NEAR(inspect_mesh(twice).volume_m3, enclosed_volume_m3(ball), 1e-6);
  EXPECT_EQ(inspect_mesh({{{0, 0, 0}}, {{0, 0, 0}}}).volume_m3, 0.0);
}

TEST(MeshReport, FindsASurfaceWithOneSide) {
  TriangleMesh strip;  // Möbius
  const std::uint32_t n = 12;
  for (std::uint32_t i = 0; i < n; ++i) {
    const double a = 2 * std::numbers::pi * i / n, half = a / 2;
    for (const double w : {-0.2, 0.2}) {
      strip.vertices_m.push_back(Vector3d((1 + w * std::cos(half)) * std::cos(a),
                                          (1 + w * std::cos(half)) * std::sin(a), w * std::sin(half))
                                     .cast<float>());
    }
    const std::uint32_t p = 2 * i, q = p + 1, r = i + 1 < n ? p + 2 : 1, s = i + 1 < n ? p + 3 : 0;
    strip.triangles.push_back({p, q, r});
    strip.triangles.push_back({q, s, r});
  }
  EXPECT_EQ(inspect_mesh(strip).unorientable_shells, 1U);
}

TEST(MeshReport, FindsTrianglesThatPassThroughOneAnother) {
  TriangleMesh crossing = make_box({1, 1, 1});
  crossing.append(moved(make_box({1, 1, 1}), {0.5, 0.4, 0.3}));
  const MeshReport report = inspect_mesh(crossing);
  EXPECT_GT(report.intersecting_pairs, 0U);
  EXPECT_TRUE(report.closed());
  EXPECT_FALSE(report.flawless());
  TriangleMesh apart = make_box({1, 1, 1});
  apart.append(moved(make_box({1, 1, 1}), {2, 0, 0}));
  EXPECT_EQ(inspect_mesh(apart).intersecting_pairs, 0U);
  // Standing on one another touches, overlapping in a plane does not pass for touching.
  const TriangleMesh flat{
      {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.2F, 0.2F, 0}, {1.2F, 0.2F, 0}, {0.2F, 1.2F, 0}},
      {{0, 1, 2}, {3, 4, 5}}};
  EXPECT_EQ(inspect_mesh(flat).intersecting_pairs, 1U);
}

/// Here every edge that meets the other box meets its edges or its faces' diagonals, and pierces no triangle.
TEST(MeshReport, FindsTrianglesThatCrossAtTheirEdgesOnly) {
  const std::array<Vector3d, 3> lying{{{0, 0, 0}, {2, 0, 0}, {0, 2, 0}}},
      upright{{{0.5, 0, -1}, {0.5, 0, 1}, {0.5, 3, 0}}}, behind{{{0.5, -1, -1}, {0.5, -1, 1}, {0.5, 0, 0}}};
  EXPECT_TRUE(detail::triangles_cross(lying, upright));
  EXPECT_TRUE(detail::triangles_cross(upright, lying));
  EXPECT_FALSE(detail::triangles_cross(lying, behind));  // touches in a point
  EXPECT_FALSE(detail::triangles_cross(behind, lying));
  TriangleMesh boxes = make_box({1, 1, 1});
  boxes.append(make_box({1, 1, 1}).transformed({Eigen::Matrix3d::Identity(), {0.5, 0.5, 0.5}}));
  EXPECT_GT(inspect_mesh(boxes).intersecting_pairs, 0U);
}

TEST(MeshReport, FlawlessBodiesCrossNothing) {
  for (const TriangleMesh& body :
       {make_sphere(0.37, 4), make_torus(0.3, 0.11, 48, 24), make_box({0.1, 0.2, 0.3})}) {
    for (const double turn_rad : {0.0, 0.3, 1.1}) {
      const Pose pose{rotation_from_rpy(turn_rad, -turn_rad, 2 * turn_rad), {0.1, 0.2, 0.3}};
      EXPECT_EQ(inspect_mesh(body.transformed(pose)).intersecting_pairs, 0U);
    }
  }
}

TEST(MeshReport, StopsAtItsLimitAndSaysSo) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> place(-1, 1);
  TriangleMesh soup;
  for (std::uint32_t i = 0; i < 300; ++i) {
    for (int k = 0; k < 3; ++k) soup.vertices_m.emplace_back(place(random), place(random), place(random));
    soup.triangles.push_back({3 * i, 3 * i + 1, 3 * i + 2});
  }
  const MeshReport all = inspect_mesh(soup), some = inspect_mesh(soup, {.max_pairs = 1000});
  EXPECT_TRUE(all.intersections_complete);
  EXPECT_FALSE(some.intersections_complete);
  EXPECT_LT(some.intersecting_pairs, all.intersecting_pairs);
  // All pairs, literally.
  std::size_t pairs = 0;
  const auto corners = [&](std::uint32_t i) {
    return std::array<Vector3d, 3>{soup.vertices_m[3 * i].cast<double>(),
                                   soup.vertices_m[3 * i + 1].cast<double>(),
                                   soup.vertices_m[3 * i + 2].cast<double>()};
  };
  for (std::uint32_t i = 0; i < 300; ++i) {
    for (std::uint32_t k = i + 1; k < 300; ++k)
      pairs += detail::triangles_cross(corners(i), corners(k)) ? 1 : 0;
  }
  EXPECT_EQ(all.intersecting_pairs, pairs);
}

/// Two triangles pass through one another if and only if the line that their planes share runs through both
/// at once.
TEST(MeshReport, CrossingAgreesWithSamplesOfBothTriangles) {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> place(-1, 1);
  int crossing = 0;
  for (int round = 0; round < 300; ++round) {
    std::array<Vector3d, 3> s, t;
    for (auto& p : s) p = {place(random), place(random), place(random)};
    for (auto& p : t) p = {place(random), place(random), place(random)};
    // Signed distances to t's plane along a fine grid over s: a change of sign within t's prism is a
    // crossing.
    const Vector3d normal = (t[1] - t[0]).cross(t[2] - t[0]);
    bool found = false;
    const int steps = 400;
    Vector3d before;
    for (int i = 0; i <= steps && !found; ++i) {
      for (int k = 0; k <= steps - i && !found; ++k) {
        const double u = static_cast<double>(i) / steps, v = static_cast<double>(k) / steps;
        const Vector3d p = s[0] + u * (s[1] - s[0]) + v * (s[2] - s[0]);
        if (k > 0 && normal.dot(p - t[0]) * normal.dot(before - t[0]) < 0) {
          const Vector3d q = 0.5 * (p + before);
          found = true;
          for (std::size_t e = 0; e < 3; ++e)
            found = found && normal.dot((t[(e + 1) % 3] - t[e]).cross(q - t[e])) > 0;
        }
        before = p;
      }
    }
    if (found) {
      EXPECT_TRUE(detail::triangles_cross(s, t));
    }
    EXPECT_EQ(detail::triangles_cross(s, t), detail::triangles_cross(t, s));
    crossing += detail::triangles_cross(s, t) ? 1 : 0;
  }
  EXPECT_GT(crossing, 20);
  EXPECT_LT(crossing, 200);
}

TEST(WindingTree, AgreesWithTheSumOverAllTriangles) {
  TriangleMesh mesh = moved(make_torus(0.5, 0.2, 80, 40), {0.2, 0.1, 0});
  std::mt19937 random(5);
  for (int i = 0; i < 500; ++i)
    mesh.triangles.erase(mesh.triangles.begin() +
                         static_cast<std::ptrdiff_t>(random() % mesh.triangles.size()));
  const WindingTree tree(mesh);
  std::uniform_real_distribution<double> place(-1, 1);
  double worst = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vector3d p(place(random), place(random), place(random));
    worst = std::max(worst, std::abs(tree.at(p) - winding_number(mesh, p)));
  }
  EXPECT_LT(worst, 0.02);
  EXPECT_EQ(WindingTree(TriangleMesh{}).at({0, 0, 0}), 0.0);
}

TEST(MeshReport, KnowsHowFineCoordinatesAre) {
  const auto at = [](double x_m) {
    return coordinate_precision(
        make_box({0.1, 0.1, 0.1}).transformed({Eigen::Matrix3d::Identity(), {x_m, 0, -1}}));
  };
  EXPECT_EQ(at(5412345.0).step_m, 0.5);
  EXPECT_EQ(at(-51234.0).step_m, 1.0 / 256);
  EXPECT_NEAR(at(-51234.0).farthest_m, 51234.05, 0.01);
  EXPECT_LT(at(0.0).step_m, 2e-7);
  EXPECT_TRUE(at(5412345.0).is_useless(0.01));
  EXPECT_FALSE(at(-51234.0).is_useless(0.02));
  EXPECT_TRUE(at(-51234.0).is_coarse(0.02));
  EXPECT_FALSE(at(-51234.0).is_coarse(0.2));
  EXPECT_FALSE(at(20.0).is_coarse(1e-4));
  EXPECT_EQ(coordinate_precision({}).step_m, 0.0);
  EXPECT_NE(describe(at(5412345.0), 0.01).find("rounded to 0.5 m"), std::string::npos);
}

}  // namespace
}  // namespace phantom::geometry
