#include "components/synthetic_viewer/render/feature_edges.hpp"

#include <gtest/gtest.h>

#include "common/geometry/implicit/primitives.hpp"

namespace phantom::synthetic_viewer {
namespace {

long features(const EdgeMesh& mesh) { return std::ranges::count_if(mesh.edges, &EdgeMesh::Edge::feature); }

TEST(FeatureEdges, ABoxHasItsTwelveAndNoDiagonal) {
  const EdgeMesh box = edges_of(geometry::make_box({1, 2, 3}));
  EXPECT_EQ(box.edges.size(), 18U);
  EXPECT_EQ(features(box), 12);
  std::vector<Line> lines;
  add_edges(box, {}, {5, 6, 7}, lines);
  EXPECT_EQ(lines.size(), 12U);
}

TEST(FeatureEdges, CornersAreWhereThreeDirectionsMeetAndAreNamedByTheSideTheyLieOn) {
  const EdgeMesh box = edges_of(geometry::make_box({1, 2, 3}));
  EXPECT_EQ(box.corners.size(), 8U);
  for (unsigned signs = 0; signs < 8; ++signs) {
    const std::array high{(signs & 1U) != 0, (signs & 2U) != 0, (signs & 4U) != 0};
    const auto corner = corner_towards(box, high);
    ASSERT_TRUE(corner);
    for (int axis = 0; axis < 3; ++axis)
      EXPECT_EQ((*corner)[axis],
                (high[static_cast<std::size_t>(axis)] ? 0.5F : -0.5F) * static_cast<float>(axis + 1));
  }
  EXPECT_TRUE(edges_of(geometry::make_sphere(1.0, 4)).corners.empty());
  EXPECT_TRUE(edges_of(geometry::make_cone(1.0, 1.0, 1.0, 48)).corners.empty()) << "rims are no corners";
  // What sticks out of a box moves its bounds, not its corners.
  geometry::TriangleMesh pinned = geometry::make_box({1, 2, 3});
  const auto first = static_cast<std::uint32_t>(pinned.vertices_m.size());
  for (const Eigen::Vector3f& place : geometry::make_cone(0.1, 0.1, 0.4, 48).vertices_m)
    pinned.vertices_m.push_back(place + Eigen::Vector3f(0.0F, 0.0F, 1.5F));
  for (auto triangle : geometry::make_cone(0.1, 0.1, 0.4, 48).triangles) {
    for (auto& corner : triangle) corner += first;
    pinned.triangles.push_back(triangle);
  }
  const auto corner = corner_towards(edges_of(pinned), {true, true, true});
  ASSERT_TRUE(corner);
  EXPECT_EQ(*corner, Eigen::Vector3f(0.5F, 1.0F, 1.5F));
}

TEST(FeatureEdges, ABallHasNoneButItsSilhouetteLiesWhereTheSightTouchesIt) {
  const EdgeMesh ball = edges_of(geometry::make_sphere(1.0, 4));
  EXPECT_EQ(features(ball), 0);
  const Eigen::Vector3d eye(4, 0, 0), middle(0.5, -0.2, 0.1);
  std::vector<Line> lines;
  add_edges(ball, {Eigen::Matrix3d::Identity(), middle}, eye, lines);
  ASSERT_GT(lines.size(), 20U);
  for (const Line& line : lines) {
    // There the radius is normal to the line of sight, but for the size of a triangle.
    const Eigen::Vector3d radius = line.from_m.cast<double>() - middle;
    const Eigen::Vector3d sight = (line.from_m.cast<double>() - eye).normalized();
    EXPECT_LT(std::abs(radius.dot(sight)), 0.15);
  }
}

TEST(FeatureEdges, BordersOfAnOpenMeshAndTrianglesWithoutAreaDoNoHarm) {
  geometry::TriangleMesh mesh;
  mesh.vertices_m = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.5F, 0, 0}, {0, 0, 0}};
  mesh.triangles = {{0, 1, 2}, {4, 3, 1}, {0, 4, 2}};  // the second and third have no area
  const EdgeMesh edges = edges_of(mesh);
  EXPECT_EQ(edges.edges.size(), 3U);
  EXPECT_EQ(features(edges), 3) << "all of them are borders";
  EXPECT_TRUE(edges_of({}).edges.empty());
}

}  // namespace
}  // namespace phantom::synthetic_viewer
