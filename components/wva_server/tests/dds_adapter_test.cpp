#include "components/wva_server/dds_adapter.hpp"

#include <gtest/gtest.h>
#include <zstd.h>

#include <map>

#include "common/dds/endpoint.hpp"
#include "common/dds/tests/test_network.hpp"
#include "common/voxel/workspace_assembler.hpp"
#include "components/wva_server/mesh_chunks.hpp"
#include "components/wva_server/tests/test_cell.hpp"
#include "components/wva_server/wva_server.hpp"
#include "phantom_idl/workspace.h"

namespace phantom::wva_server {
namespace {

geometry::TriangleMesh unpack(const std::vector<std::vector<std::uint8_t>>& chunks, std::uint32_t vertices,
                              std::uint32_t triangles) {
  std::vector<std::uint8_t> packed;
  for (const auto& chunk : chunks) packed.insert(packed.end(), chunk.begin(), chunk.end());
  std::vector<std::uint8_t> plain(12 * (std::size_t{vertices} + triangles));
  EXPECT_EQ(ZSTD_decompress(plain.data(), plain.size(), packed.data(), packed.size()), plain.size());
  geometry::TriangleMesh mesh;
  EXPECT_TRUE(geometry::mesh_from_bytes(plain.data(), plain.size(), vertices, triangles, mesh));
  return mesh;
}

TEST(MeshChunks, AreSmallEnoughAndMakeTheMeshAgain) {
  const auto mesh = geometry::make_sphere(0.3, 5);
  const auto chunks = mesh_chunks(mesh, 4096);
  EXPECT_GT(chunks.size(), 10U);
  for (const auto& chunk : chunks) {
    EXPECT_LE(chunk.size(), 4096U);
    EXPECT_FALSE(chunk.empty());
  }
  const auto back = unpack(chunks, static_cast<std::uint32_t>(mesh.vertices_m.size()),
                           static_cast<std::uint32_t>(mesh.triangles.size()));
  EXPECT_EQ(back.content_hash(), mesh.content_hash());
}

/// What a consumer of all workspace topics ends up with.
class Consumer {
 public:
  explicit Consumer(const core::NetworkOptions& network)
      : participant_("consumer", network),
        bricks_(
            participant_, dds::kWorkspaceBrick,
            [this](const msg::WorkspaceBrick& b, const dds::SampleInfo& info) {
              waiter_.change([&] {
                const voxel::BrickKey key{b.bx(), b.by(), b.bz()};
                keys_[info.instance] = key;
                EXPECT_TRUE(assembler_.put_brick(key, b.version(), b.voxels_zstd()));
              });
            },
            [this](const dds::InstanceId& gone) {
              waiter_.change([&] {  // a late joiner also hears of instances that it never saw alive
                if (const auto known = keys_.find(gone); known != keys_.end())
                  assembler_.remove_brick(known->second);
              });
            }),
        versions_(participant_, dds::kWorkspaceVersion,
                  [this](const msg::WorkspaceVersion& v, const dds::SampleInfo&) {
                    waiter_.change([&] {
                      voxel::VersionDescription d;
                      d.version = v.version();
                      d.grid = {{v.origin_m().x(), v.origin_m().y(), v.origin_m().z()},
                                v.voxel_size_m(),
                                {static_cast<std::int32_t>(v.size_x_vox()),
                                 static_cast<std::int32_t>(v.size_y_vox()),
                                 static_cast<std::int32_t>(v.size_z_vox())}};
                      d.palette_Pa_s_per_m = v.palette();
                      d.brick_count = v.brick_count();
                      d.content_hash = v.content_hash();
                      EXPECT_TRUE(assembler_.commit(d));
                    });
                  }),
        objects_(participant_, dds::kWorkspaceObject,
                 [this](const msg::WorkspaceObject& o, const dds::SampleInfo&) {
                   waiter_.change([&] { seen_objects_[o.id()] = o; });
                 }),
        chunks_(participant_, dds::kMeshChunk, [this](const msg::MeshChunk& c, const dds::SampleInfo&) {
          waiter_.change([&] { seen_chunks_[{c.mesh_hash(), c.chunk()}] = c; });
        }) {}

  bool has_version(std::uint64_t version) {
    return waiter_.wait([&] { return assembler_.current() && assembler_.current()->version == version; });
  }
  bool has_objects(std::size_t objects, std::size_t chunks) {
    return waiter_.wait([&] { return seen_objects_.size() == objects && seen_chunks_.size() == chunks; });
  }
  const voxel::Workspace& workspace() const { return *assembler_.current(); }
  const std::map<std::uint16_t, msg::WorkspaceObject>& objects() const { return seen_objects_; }
  const std::map<std::pair<std::uint64_t, std::uint32_t>, msg::MeshChunk>& chunks() const {
    return seen_chunks_;
  }

 private:
  dds::Waiter waiter_;
  voxel::WorkspaceAssembler assembler_;
  std::map<dds::InstanceId, voxel::BrickKey> keys_;
  std::map<std::uint16_t, msg::WorkspaceObject> seen_objects_;
  std::map<std::pair<std::uint64_t, std::uint32_t>, msg::MeshChunk> seen_chunks_;
  dds::Participant participant_;  // the readers below end before what they write to
  dds::Reader<msg::WorkspaceBrick> bricks_;
  dds::Reader<msg::WorkspaceVersion> versions_;
  dds::Reader<msg::WorkspaceObject> objects_;
  dds::Reader<msg::MeshChunk> chunks_;
};

class DdsAdapterTest : public TestCell {
 protected:
  static ActivatedCell activated(const runtime::CellConfig& cell, const std::vector<runtime::CellBody>& bodies,
                                 std::uint64_t version) {
    return activate(
        grid_of(cell), bodies, version, [] { return 0.0; }, [](const auto&...) {}, [] { return true; });
  }
};

TEST_F(DdsAdapterTest, EarlyAndLateConsumersHaveTheWholeCell) {
  const auto cell_config = runtime::load_cell(cell());
  const auto bodies = load_bodies(cell_config, {});
  const auto result = activated(cell_config, bodies, 41);
  Consumer early(dds::test_network());
  DdsAdapter adapter(dds::test_network());
  adapter.publish_objects(cell_config, bodies, 1024);
  adapter.publish_workspace(cell_config.name, *result.workspace);
  Consumer late(dds::test_network());

  std::size_t chunks = 0;
  for (const std::size_t i : {0U, 1U})
    chunks += mesh_chunks(bodies[i].mesh_O, 1024).size();  // both posts share one mesh
  for (Consumer* consumer : {&early, &late}) {
    ASSERT_TRUE(consumer->has_version(41));
    EXPECT_EQ(consumer->workspace().content_hash(), result.workspace->content_hash());
    EXPECT_EQ(consumer->workspace().bricks(), result.workspace->bricks());
    ASSERT_TRUE(consumer->has_objects(3, chunks));
  }
  const msg::WorkspaceObject& left = late.objects().at(2);
  EXPECT_EQ(left.name(), "left post");
  EXPECT_DOUBLE_EQ(left.X_WO().position_m().x(), -0.2);
  EXPECT_NEAR(left.X_WO().qz(), std::sin(15 * M_PI / 180), 1e-9);
  EXPECT_EQ(left.mesh_hash(), late.objects().at(3).mesh_hash());
  EXPECT_EQ(late.objects().at(1).red(), 1.0F);

  std::vector<std::vector<std::uint8_t>> pieces;
  msg::MeshChunk last;
  for (const auto& [key, chunk] : late.chunks()) {
    if (key.first != bodies[0].mesh_O.content_hash()) continue;
    pieces.push_back(chunk.data());
    last = chunk;
  }
  ASSERT_EQ(pieces.size(), last.chunk_count());
  EXPECT_EQ(unpack(pieces, last.vertex_count(), last.triangle_count()).content_hash(),
            bodies[0].mesh_O.content_hash());
}

TEST_F(DdsAdapterTest, BricksThatAreGoneAreDisposed) {
  const auto cell_config = runtime::load_cell(cell());
  auto bodies = load_bodies(cell_config, {});
  const auto full = activated(cell_config, bodies, 41);
  Consumer early(dds::test_network());
  DdsAdapter adapter(dds::test_network());
  adapter.publish_workspace(cell_config.name, *full.workspace);
  ASSERT_TRUE(early.has_version(41));
  bodies.erase(bodies.begin(), bodies.begin() + 2);
  const auto fewer = activated(cell_config, bodies, 42);
  ASSERT_LT(fewer.workspace->brick_count(), full.workspace->brick_count());
  adapter.publish_workspace(cell_config.name, *fewer.workspace);
  Consumer late(dds::test_network());
  for (Consumer* consumer : {&early, &late}) {
    ASSERT_TRUE(consumer->has_version(42));
    EXPECT_EQ(consumer->workspace().content_hash(), fewer.workspace->content_hash());
  }
}

TEST_F(DdsAdapterTest, ASuccessorsCellReplacesThatOfAServerThatDied) {
  const auto cell_config = runtime::load_cell(cell());
  auto bodies = load_bodies(cell_config, {});
  Consumer consumer(dds::test_network());
  {
    DdsAdapter first(dds::test_network());
    first.publish_workspace(cell_config.name, *activated(cell_config, bodies, 41).workspace);
    ASSERT_TRUE(consumer.has_version(41));
  }
  bodies.erase(bodies.begin(), bodies.begin() + 2);
  const auto fewer = activated(cell_config, bodies, 50);
  DdsAdapter second(dds::test_network());
  second.publish_workspace(cell_config.name, *fewer.workspace);
  ASSERT_TRUE(consumer.has_version(50));
  EXPECT_EQ(consumer.workspace().content_hash(), fewer.workspace->content_hash());
}

}  // namespace
}  // namespace phantom::wva_server
