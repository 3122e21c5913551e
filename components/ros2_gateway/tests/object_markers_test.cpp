#include "components/ros2_gateway/object_markers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "common/workspace/compression.hpp"
#include "tests/support/small_arms.hpp"

namespace phantom::ros2_gateway {
namespace {

using testing::HasSubstr;

geometry::TriangleMesh a_mesh(std::size_t triangles = 1, float size_m = 1.0F) {
  geometry::TriangleMesh mesh;
  mesh.vertices_m = {{0, 0, 0}, {size_m, 0, 0}, {0, size_m, 0}};
  mesh.triangles.assign(triangles, {0, 1, 2});
  return mesh;
}
messages::MeshChunk chunk_of(const geometry::TriangleMesh& mesh) {
  messages::MeshChunk chunk;
  chunk.mesh_hash = mesh.content_hash();
  chunk.chunk_count = 1;
  chunk.vertex_count = static_cast<std::uint32_t>(mesh.vertices_m.size());
  chunk.triangle_count = static_cast<std::uint32_t>(mesh.triangles.size());
  chunk.data = workspace::compress(geometry::mesh_bytes(mesh));
  return chunk;
}
messages::WorkspaceObject object(std::uint16_t id, std::uint64_t mesh_hash) {
  messages::WorkspaceObject made{
      .id = id, .name = "pump", .mesh_hash = mesh_hash, .X_WO = {}, .colour = {0.5F, 0.25F, 0.0F}};
  made.X_WO.translation_m = {1.0, 2.0, 3.0};
  return made;
}

TEST(ObjectMarkers, AreThereOnceObjectAndMeshAreInEitherOrder) {
  const geometry::TriangleMesh mesh = a_mesh();
  for (const bool mesh_first : {false, true}) {
    ObjectMarkers markers(phantom::test::one_joint(), "left");
    if (mesh_first) {
      EXPECT_TRUE(markers.take(chunk_of(mesh)));
    }
    markers.take(object(7, mesh.content_hash()));
    const auto at_first = markers.changes();
    ASSERT_EQ(at_first.size(), 1u);
    EXPECT_EQ(at_first[0].there, mesh_first);
    if (!mesh_first) {
      EXPECT_TRUE(markers.take(chunk_of(mesh)));
      ASSERT_EQ(markers.changes().size(), 1u);
    }
    EXPECT_TRUE(markers.changes().empty());
    const auto all = markers.all();
    ASSERT_EQ(all.size(), 1u);
    EXPECT_EQ(all[0].id, 7u);
    EXPECT_EQ(all[0].mesh->triangles.size(), 1u);
    EXPECT_EQ(all[0].X_FO.translation_m, Eigen::Vector3d(1.0, 2.0, 3.0));
    EXPECT_EQ(all[0].frame, "");
  }
}

TEST(ObjectMarkers, OfProtectedZonesAreSeeThrough) {
  const geometry::TriangleMesh mesh = a_mesh();
  ObjectMarkers markers(phantom::test::one_joint(), "left", {7});
  EXPECT_TRUE(markers.take(chunk_of(mesh)));
  for (const std::uint16_t id : {std::uint16_t{7}, std::uint16_t{8}})
    markers.take(object(id, mesh.content_hash()));
  const auto all = markers.all();
  ASSERT_EQ(all.size(), 2u);
  EXPECT_LT(all[0].opacity, 1.0F);
  EXPECT_EQ(all[1].opacity, 1.0F);
}

TEST(ObjectMarkers, ChangeOneByOne) {
  const geometry::TriangleMesh mesh = a_mesh();
  ObjectMarkers markers(phantom::test::one_joint(), "left");
  EXPECT_TRUE(markers.take(chunk_of(mesh)));
  for (std::uint16_t id = 1; id <= 3; ++id) markers.take(object(id, mesh.content_hash()));
  EXPECT_EQ(markers.changes().size(), 3u);
  messages::WorkspaceObject moved = object(2, mesh.content_hash());
  moved.X_WO.translation_m.x() = 9.0;
  markers.take(moved);
  const auto changed = markers.changes();
  ASSERT_EQ(changed.size(), 1u);
  EXPECT_EQ(changed[0].id, 2u);
  EXPECT_EQ(changed[0].X_FO.translation_m.x(), 9.0);
  markers.take(messages::WorkspaceObject{.id = 1});
  const auto removed = markers.changes();
  ASSERT_EQ(removed.size(), 1u);
  EXPECT_FALSE(removed[0].there);
  EXPECT_EQ(markers.all().size(), 2u);
}

TEST(ObjectMarkers, StandInTheLinkThatCarriesThem) {
  const geometry::TriangleMesh mesh = a_mesh();
  ObjectMarkers markers(phantom::test::one_joint(), "left");
  EXPECT_TRUE(markers.take(chunk_of(mesh)));
  markers.take(object(1, mesh.content_hash()));
  markers.changes();
  messages::CarriedObject carried{
      .id = 1, .arm = "left", .frame = "forearm", .X_FO = {}, .mesh_hash = mesh.content_hash()};
  carried.X_FO.translation_m = {0.1, 0.0, 0.0};
  markers.take(std::vector{carried});
  auto changed = markers.changes();
  ASSERT_EQ(changed.size(), 1u);
  EXPECT_TRUE(changed[0].there);
  EXPECT_EQ(changed[0].frame, "forearm");
  EXPECT_EQ(changed[0].X_FO.translation_m.x(), 0.1);
  carried.arm = "right";
  markers.take(std::vector{carried});
  changed = markers.changes();
  ASSERT_EQ(changed.size(), 1u);
  EXPECT_FALSE(changed[0].there) << "where another arm is, is not known";
  markers.take(std::vector<messages::CarriedObject>());
  changed = markers.changes();
  ASSERT_EQ(changed.size(), 1u);
  EXPECT_TRUE(changed[0].there);
  EXPECT_EQ(changed[0].frame, "");
}

TEST(ObjectMarkers, AreBoundedInTrianglesAndForgetMeshesThatNobodyNames) {
  constexpr std::size_t kHalf = ObjectMarkers::kMaxTriangles / 2;
  ObjectMarkers markers(phantom::test::one_joint(), "left");
  const auto first = a_mesh(kHalf), second = a_mesh(kHalf, 2.0F), third = a_mesh(kHalf, 3.0F);
  EXPECT_TRUE(markers.take(chunk_of(first)));
  EXPECT_TRUE(markers.take(chunk_of(second)));
  markers.take(object(1, first.content_hash()));
  markers.take(object(2, second.content_hash()));
  EXPECT_THAT(markers.take(chunk_of(third)).message(), HasSubstr("a mesh of 1000000 triangles"));
  markers.take(messages::WorkspaceObject{.id = 1});
  EXPECT_TRUE(markers.take(chunk_of(third)));
  markers.take(object(1, third.content_hash()));
  EXPECT_EQ(markers.all().size(), 2u);
}

}  // namespace
}  // namespace phantom::ros2_gateway
