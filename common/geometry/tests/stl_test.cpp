#include "common/geometry/mesh/stl.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/geometry/mesh/mesh_topology.hpp"

namespace phantom::geometry {
namespace {

TEST(BinaryStl, ComesBackWithItsCornersJoined) {
  for (const TriangleMesh& mesh : {make_sphere(0.3, 4), make_torus(0.2, 0.05, 40, 20), make_box({1, 2, 3})}) {
    const StlMesh back = read_binary_stl(binary_stl(mesh));
    EXPECT_TRUE(back.finite);
    EXPECT_EQ(back.collapsed, 0U);
    ASSERT_EQ(back.triangles.size(), mesh.triangles.size());
    EXPECT_EQ(back.vertices_m.size(), mesh.vertices_m.size());
    EXPECT_TRUE(is_oriented_surface(back.triangles));
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
      for (std::size_t k = 0; k < 3; ++k)
        ASSERT_EQ(back.vertices_m[back.triangles[i][k]], mesh.vertices_m[mesh.triangles[i][k]]);
    }
  }
}

TEST(BinaryStl, JoinsBothZeros) {
  TriangleMesh mesh;
  mesh.vertices_m = {{0.0F, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-0.0F, -0.0F, -0.0F}, {0, 0, 1}, {1, 0, 0}};
  mesh.triangles = {{0, 1, 2}, {3, 4, 5}};
  EXPECT_EQ(read_binary_stl(binary_stl(mesh)).vertices_m.size(), 4U);
}

TEST(BinaryStl, LeavesOutTrianglesWithTwoCornersInOnePlace) {
  TriangleMesh mesh = make_box({1, 1, 1});
  mesh.triangles.push_back({3, 5, 3});
  const StlMesh back = read_binary_stl(binary_stl(mesh));
  EXPECT_EQ(back.collapsed, 1U);
  EXPECT_EQ(back.triangles.size(), 12U);
}

TEST(BinaryStl, TellsOfCoordinatesThatAreNotFinite) {
  TriangleMesh mesh = make_box({1, 1, 1});
  mesh.vertices_m[2].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(read_binary_stl(binary_stl(mesh)).finite);
}

TEST(BinaryStl, IsKnownByItsSize) {
  const auto bytes = binary_stl(make_box({1, 1, 1}));
  EXPECT_EQ(binary_stl_triangles(bytes, bytes.size()), 12U);
  EXPECT_FALSE(binary_stl_triangles(bytes, bytes.size() - 1));
  EXPECT_FALSE(binary_stl_triangles(bytes, bytes.size() + 1));
  EXPECT_FALSE(binary_stl_triangles({bytes.data(), 83}, 83));
  EXPECT_FALSE(binary_stl_triangles({}, 0));
  for (std::size_t cut = 0; cut < bytes.size(); ++cut)
    EXPECT_TRUE(read_binary_stl({bytes.data(), cut}).triangles.empty());
}

}  // namespace
}  // namespace phantom::geometry
