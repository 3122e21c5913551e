#include "common/geometry/mesh/mesh.hpp"

#include <gtest/gtest.h>

#include <map>
#include <numbers>
#include <random>
#include <utility>

#include "common/geometry/implicit/primitives.hpp"

namespace phantom::geometry {
namespace {

constexpr double kPi = std::numbers::pi;

/// Closed and consistently oriented: every directed edge once, its opposite once.
bool is_closed(const TriangleMesh& mesh) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  }
  for (const auto& [edge, count] : edges) {
    const auto opposite = edges.find({edge.second, edge.first});
    if (count != 1 || opposite == edges.end() || opposite->second != 1) return false;
  }
  return true;
}

TEST(Primitives, AreClosedAndFaceOutwards) {
  const struct {
    TriangleMesh mesh;
    double volume_m3;
    double tolerance;
  } solids[] = {
      {make_box({0.2, 0.3, 0.4}), 0.024, 1e-6},
      {make_sphere(0.3, 5), 4.0 / 3.0 * kPi * 0.027, 2e-3},
      {make_cylinder(0.1, 0.5, 200), kPi * 0.01 * 0.5, 1e-3},
      {make_torus(0.3, 0.1, 200, 100), 2 * kPi * kPi * 0.3 * 0.01, 2e-3},
  };
  for (const auto& solid : solids) {
    EXPECT_TRUE(is_closed(solid.mesh));
    EXPECT_NEAR(enclosed_volume_m3(solid.mesh) / solid.volume_m3, 1.0, solid.tolerance);
  }
  EXPECT_EQ(make_sphere(1.0, 3).triangles.size(), 20U * 64U);
}

TEST(TriangleMesh, MovesWithItsFrame) {
  const TriangleMesh box = make_box({0.2, 0.3, 0.4});
  const Pose X_WO{rotation_about(Eigen::Vector3d::UnitZ(), kPi / 2), {1.0, 2.0, 3.0}};
  const BoundingBox bounds = box.transformed(X_WO).bounding_box();
  EXPECT_TRUE(bounds.min_m.isApprox(Eigen::Vector3f(0.85F, 1.9F, 2.8F), 1e-6F));
  EXPECT_TRUE(bounds.max_m.isApprox(Eigen::Vector3f(1.15F, 2.1F, 3.2F), 1e-6F));
  EXPECT_NEAR(enclosed_volume_m3(box.transformed(X_WO)), 0.024, 1e-6);
}

TEST(TriangleMesh, HashIsFnv1aOfItsBytes) {
  TriangleMesh mesh = make_box({1, 1, 1});
  std::uint64_t expected = 14695981039346656037ULL;
  for (const std::uint8_t byte : mesh_bytes(mesh)) expected = (expected ^ byte) * 1099511628211ULL;
  EXPECT_EQ(mesh.content_hash(), expected);
  mesh.vertices_m[3].y() += 1e-3F;
  EXPECT_NE(mesh.content_hash(), expected);
}

TEST(TriangleMesh, SurvivesItsBytes) {
  const TriangleMesh mesh = make_torus(0.3, 0.1, 12, 8);
  const auto bytes = mesh_bytes(mesh);
  TriangleMesh back;
  ASSERT_TRUE(mesh_from_bytes(bytes.data(), bytes.size(), 96, 192, back));
  EXPECT_EQ(back.content_hash(), mesh.content_hash());
}

TEST(TriangleMesh, RefusesBytesThatAreNoMesh) {
  auto bytes = mesh_bytes(make_box({1, 1, 1}));
  TriangleMesh mesh;
  EXPECT_FALSE(mesh_from_bytes(bytes.data(), bytes.size() - 1, 8, 12, mesh));
  EXPECT_FALSE(mesh_from_bytes(bytes.data(), bytes.size(), 9, 12, mesh));
  auto bad_index = bytes;
  bad_index.back() = 0x7f;
  EXPECT_FALSE(mesh_from_bytes(bad_index.data(), bad_index.size(), 8, 12, mesh));
  auto not_finite = bytes;
  not_finite[2] = 0xc0;
  not_finite[3] = 0x7f;
  EXPECT_FALSE(mesh_from_bytes(not_finite.data(), not_finite.size(), 8, 12, mesh));
}

TEST(TriangleMesh, BoundingBoxHoldsEveryVertexHoweverMany) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> coordinate(-9.0F, 9.0F);
  for (std::size_t count = 1; count < 30; ++count) {
    TriangleMesh mesh;
    Eigen::Vector3f low = Eigen::Vector3f::Constant(10.0F), high = -low;
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector3f vertex{coordinate(random), coordinate(random), coordinate(random)};
      mesh.vertices_m.push_back(vertex);
      low = low.cwiseMin(vertex);
      high = high.cwiseMax(vertex);
    }
    EXPECT_EQ(mesh.bounding_box().min_m, low) << count;
    EXPECT_EQ(mesh.bounding_box().max_m, high) << count;
    EXPECT_TRUE(mesh.all_finite());
    for (std::size_t i = 0; i < count; ++i) {
      for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(),
                              -std::numeric_limits<float>::infinity()}) {
        TriangleMesh worse = mesh;
        worse.vertices_m[i][static_cast<Eigen::Index>(random() % 3)] = bad;
        EXPECT_FALSE(worse.all_finite()) << count << ' ' << i << ' ' << bad;
      }
    }
  }
  EXPECT_EQ(TriangleMesh{}.bounding_box().min_m, BoundingBox{}.min_m);
}

}  // namespace
}  // namespace phantom::geometry
