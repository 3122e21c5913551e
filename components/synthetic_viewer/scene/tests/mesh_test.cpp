#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <random>

#include "common/geometry/implicit/primitives.hpp"
#include "common/messages/mesh_assembler.hpp"
#include "components/synthetic_viewer/render/ray_scene.hpp"
#include "components/synthetic_viewer/render/shaded_mesh.hpp"
#include "components/synthetic_viewer/samples/tests/mesh_chunks.hpp"

namespace phantom::synthetic_viewer {
namespace {

using messages::MeshAssembler;
using test::chunks_of;

/// The status of the last chunk's addition, and whether a mesh came out.
std::pair<core::Status, bool> add_all(MeshAssembler& assembler, const std::vector<MeshChunkSample>& chunks) {
  for (const MeshChunkSample& chunk : chunks) {
    auto result = assembler.add(chunk);
    if (!result) return {result.status(), false};
    if (result->has_value()) return {core::Status::ok(), true};
  }
  return {core::Status::ok(), false};
}

class Assembler : public ::testing::Test {
 protected:
  geometry::TriangleMesh mesh_ = geometry::make_sphere(0.3, 3);
  std::vector<MeshChunkSample> chunks_ = chunks_of(mesh_, 1000);
  MeshAssembler assembler_;
};

TEST_F(Assembler, GivesTheMeshBackWhateverTheOrderOfItsChunks) {
  ASSERT_GT(chunks_.size(), 3U);
  std::mt19937 random(7);
  std::shuffle(chunks_.begin(), chunks_.end(), random);
  for (std::size_t i = 0; i < chunks_.size(); ++i) {
    auto result = assembler_.add(chunks_[i]);
    ASSERT_TRUE(result);
    ASSERT_EQ(result->has_value(), i + 1 == chunks_.size());
    if (result->has_value()) {
      EXPECT_EQ((*result)->content_hash(), mesh_.content_hash());
    }
  }
  EXPECT_EQ(assembler_.pending(), 0U);
}

// Tries synthetic_viewer: more meshes begin
TEST_F(Assembler, DoesNotGrowWithTheNumberOfMeshesThatBegin) {
  MeshChunkSample chunk = chunks_[0];
  chunk.chunk_count = 4096;
  chunk.data = {1};
  for (std::uint64_t hash = 1; hash <= 20'000; ++hash) {
    chunk.mesh_hash = hash;
    chunk.chunk = static_cast<std::uint32_t>(hash % 4096);
    ASSERT_TRUE(assembler_.add(chunk));
    ASSERT_LE(assembler_.pending(), MeshAssembler::kMaxPending);
    ASSERT_LE(assembler_.bytes(), 16'384U);
  }
  EXPECT_EQ(assembler_.given_up(), 20'000U - MeshAssembler::kMaxPending);
  EXPECT_TRUE(add_all(assembler_, chunks_).second);  // others are still taken
}

// Tries synthetic_viewer: more meshes begin
TEST_F(Assembler, GivesUpWhatBeganFirstWhenTheMemoryIsUsedUp) {
  MeshChunkSample chunk = chunks_[0];
  chunk.chunk_count = 4096;
  chunk.data.assign(std::size_t{256} << 10, 7);
  for (std::uint64_t hash = 1; hash <= 9; ++hash) {
    chunk.mesh_hash = hash;
    for (chunk.chunk = 0; chunk.chunk < 255; ++chunk.chunk) ASSERT_TRUE(assembler_.add(chunk));
    ASSERT_LE(assembler_.bytes(), MeshAssembler::kMaxBytes);
  }
  EXPECT_EQ(assembler_.given_up(), 1U);
}

TEST_F(Assembler, ARepeatedChunkChangesNothing) {
  ASSERT_TRUE(assembler_.add(chunks_[0]));
  ASSERT_TRUE(assembler_.add(chunks_[0]));
  EXPECT_TRUE(add_all(assembler_, chunks_).second);
}

TEST_F(Assembler, RefusesADamagedChunkAndHealsWhenItComesAgain) {
  auto damaged = chunks_;
  damaged[1].data[500] ^= 0x55;
  const auto [status, complete] = add_all(assembler_, damaged);
  EXPECT_FALSE(complete);
  EXPECT_FALSE(status.is_ok());
  EXPECT_TRUE(add_all(assembler_, chunks_).second);
}

TEST_F(Assembler, RefusesAMeshThatHasNotTheAnnouncedHash) {
  for (MeshChunkSample& chunk : chunks_) chunk.mesh_hash ^= 1;
  EXPECT_NE(add_all(assembler_, chunks_).first.message().find("hash"), std::string::npos);
}

TEST_F(Assembler, RefusesAMeshThatHasNotTheAnnouncedSize) {
  for (MeshChunkSample& chunk : chunks_) ++chunk.vertex_count;
  EXPECT_NE(add_all(assembler_, chunks_).first.message().find("does not unpack"), std::string::npos);
}

TEST_F(Assembler, RefusesChunksThatDisagree) {
  chunks_[2].triangle_count += 5;
  EXPECT_NE(add_all(assembler_, chunks_).first.message().find("disagree"), std::string::npos);
}

TEST_F(Assembler, RefusesIndicesBeyondTheVertices) {
  mesh_.triangles[10][1] = static_cast<std::uint32_t>(mesh_.vertices_m.size());
  EXPECT_NE(add_all(assembler_, chunks_of(mesh_, 1000)).first.message().find("does not exist"),
            std::string::npos);
}

TEST_F(Assembler, RefusesCoordinatesThatAreNotFinite) {
  mesh_.vertices_m[3].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(add_all(assembler_, chunks_of(mesh_, 1000)).first.message().find("finite"), std::string::npos);
}

/// Literal twin of the ray tree: every triangle, solved as a linear system.
std::optional<double> nearest_literally(const geometry::TriangleMesh& mesh, const Eigen::Vector3d& origin,
                                        const Eigen::Vector3d& direction) {
  std::optional<double> best;
  for (const auto& t : mesh.triangles) {
    const Eigen::Vector3d a = mesh.vertices_m[t[0]].cast<double>();
    Eigen::Matrix3d system;
    system << mesh.vertices_m[t[1]].cast<double>() - a, mesh.vertices_m[t[2]].cast<double>() - a, -direction;
    if (std::abs(system.determinant()) < 1e-15) continue;
    const Eigen::Vector3d uvt = system.inverse() * (origin - a);
    const bool inside = uvt[0] >= 0 && uvt[1] >= 0 && uvt[0] + uvt[1] <= 1;
    if (inside && uvt[2] > 0 && (!best || uvt[2] < *best)) best = uvt[2];
  }
  return best;
}

TEST(RayScene, TheWayToAZoneEndsWhereItBeginsAndIsNoneInside) {
  RayScene scene;
  const auto ball = std::make_shared<RayMesh>(geometry::make_sphere(0.1, 4));
  scene.zones.push_back({ball, {Eigen::Matrix3d::Identity(), {1.0, 0.0, 0.0}}, {4, 0}});
  const Eigen::Vector3d ahead = Eigen::Vector3d::UnitX();
  const auto way_m = [&](double x_m, double most_m = 1.0) {
    return scene.to_zone(4, {x_m, 0.001, 0.002}, ahead, most_m);
  };
  EXPECT_NEAR(way_m(0.5).value_or(-1.0), 0.4, 1e-3);
  EXPECT_EQ(way_m(0.95), 0.0) << "inside";
  EXPECT_EQ(way_m(0.95, 0.01), 0.0) << "however far the other side is";
  EXPECT_EQ(way_m(0.5, 0.3), std::nullopt) << "too far";
  EXPECT_EQ(way_m(1.2), std::nullopt) << "behind";
  EXPECT_EQ(scene.to_zone(5, {0.5, 0.001, 0.002}, ahead, 1.0), std::nullopt) << "another's";
  EXPECT_FALSE(scene.nearest({0.5, 0.001, 0.002}, ahead, 0.0, 1.0)) << "sight goes through";
}

TEST(RayMesh, AgreesWithItsLiteralTwin) {
  const geometry::TriangleMesh torus = geometry::make_torus(0.4, 0.12, 40, 17);
  const RayMesh tree(torus);
  std::mt19937 random(3);
  std::normal_distribution<double> normal;
  int hits = 0;
  for (int k = 0; k < 2000; ++k) {
    const Eigen::Vector3d origin(normal(random), normal(random), normal(random));
    const Eigen::Vector3d direction =
        Eigen::Vector3d(normal(random), normal(random), normal(random)).normalized();
    const auto expected = nearest_literally(torus, origin, direction);
    const auto found = tree.nearest(origin, direction, 0.0, 1e9);
    ASSERT_EQ(found.has_value(), expected.has_value()) << k;
    if (expected) {
      EXPECT_NEAR(*found, *expected, 1e-9);
    }
    hits += found.has_value();
  }
  EXPECT_GT(hits, 50);
}

TEST(RayMesh, RaysAlongTheAxesHitABox) {
  const RayMesh box(geometry::make_box({1, 1, 1}));
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector3d origin(0.1, 0.05, -0.2), direction = Eigen::Vector3d::Zero();
    origin[axis] = -3;
    direction[axis] = 1;
    const auto distance = box.nearest(origin, direction, 0.0, 100.0);
    ASSERT_TRUE(distance);
    EXPECT_NEAR(*distance, 2.5, 1e-6);
    EXPECT_FALSE(box.nearest(origin, -direction, 0.0, 100.0));
    EXPECT_FALSE(box.nearest(origin, direction, 0.0, 2.0));
  }
}

TEST(RayMesh, AnEmptyMeshIsHitByNothing) {
  EXPECT_FALSE(RayMesh({}).nearest(Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), 0, 1e9));
}

TEST(Shade, SmoothsASphereAndKeepsABoxSharp) {
  const ShadedMesh sphere = shade(geometry::make_sphere(1.0, 3));
  for (const auto& v : sphere.vertices) {
    const Eigen::Map<const Eigen::Vector3f> position(v.position_m.data()), normal(v.normal.data());
    EXPECT_GT(normal.dot(position.normalized()), 0.999F);
  }
  EXPECT_EQ(sphere.vertices.size(), geometry::make_sphere(1.0, 3).vertices_m.size());  // shared all over
  const ShadedMesh box = shade(geometry::make_box({1, 2, 3}));
  EXPECT_EQ(box.vertices.size(), 24U);  // four per face
  for (const auto& v : box.vertices) {
    EXPECT_FLOAT_EQ(Eigen::Map<const Eigen::Vector3f>(v.normal.data()).cwiseAbs().maxCoeff(), 1.0F);
  }
}

TEST(Shade, JoinsVerticesThatTheSourceDoesNotShare) {
  const geometry::TriangleMesh sphere = geometry::make_sphere(1.0, 2);
  geometry::TriangleMesh soup;
  for (const auto& t : sphere.triangles) {
    const auto first = static_cast<std::uint32_t>(soup.vertices_m.size());
    for (const std::uint32_t vertex : t) soup.vertices_m.push_back(sphere.vertices_m[vertex]);
    soup.triangles.push_back({first, first + 1, first + 2});
  }
  EXPECT_EQ(shade(soup).vertices.size(), sphere.vertices_m.size());
}

TEST(Shade, LeavesOutTrianglesWithoutArea) {
  geometry::TriangleMesh mesh = geometry::make_box({1, 1, 1});
  mesh.triangles.push_back({0, 1, 1});
  EXPECT_EQ(shade(mesh).indices.size(), 36U);
}

TEST(Coarsen, KeepsTheOutlineWithFewerTriangles) {
  const geometry::TriangleMesh ball = geometry::make_sphere(0.2, 5);
  const geometry::TriangleMesh coarse = coarsen(ball, 0.03);
  EXPECT_LT(coarse.triangles.size(), ball.triangles.size() / 10);
  EXPECT_GT(coarse.triangles.size(), 100U);
  for (const Eigen::Vector3f& v : coarse.vertices_m) EXPECT_NEAR(v.norm(), 0.2, 0.03);
  for (const auto& t : coarse.triangles)
    EXPECT_LT(*std::max_element(t.begin(), t.end()), coarse.vertices_m.size());
  EXPECT_TRUE(coarsen({}, 0.03).triangles.empty());
}

TEST(Shade, ManyTrianglesAtOnePlaceTakeNoQuadraticTime) {
  geometry::TriangleMesh fan;
  constexpr std::uint32_t kBlades = 200'000;
  fan.vertices_m.emplace_back(0, 0, 0);
  for (std::uint32_t i = 0; i <= kBlades; ++i) {
    const float angle = 6.28F * static_cast<float>(i) / kBlades;
    fan.vertices_m.emplace_back(std::cos(angle), std::sin(angle), 0.0F);
  }
  for (std::uint32_t i = 1; i <= kBlades; ++i) fan.triangles.push_back({0, i, i + 1});
  EXPECT_EQ(shade(fan).indices.size(), 3 * kBlades);
}

}  // namespace
}  // namespace phantom::synthetic_viewer
