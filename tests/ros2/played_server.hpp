#pragma once

#include <set>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/topics.hpp"
#include "common/geometry/mesh/mesh.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/workspace/brick_codec.hpp"
#include "common/workspace/compression.hpp"
#include "common/workspace/workspace.hpp"

namespace phantom::ros2::test {

/// What wva_server publishes.
class PlayedServer {
 public:
  explicit PlayedServer(dds::Participant& participant)
      : bricks_(participant, dds::kWorkspaceBrick),
        versions_(participant, dds::kWorkspaceVersion),
        objects_(participant, dds::kWorkspaceObject),
        chunks_(participant, dds::kMeshChunk) {
    workspace::GridSpec grid;
    grid.voxel_size_m = 0.01;
    grid.size_vox = {64, 64, 32};
    workspace_ = workspace::Workspace(grid, {0.0F, 1.0F});
  }
  void set(workspace::Index3 v, std::int8_t order) {
    const auto brick = workspace_.edit_brick(workspace::brick_of(v));
    const std::size_t at = workspace::brick_offset(v);
    brick.order[at] = order;
    brick.mu_code[at] = order != 0 ? 1 : 0;
    brick.object[at] = order != 0 ? 7 : 0;
    changed_.insert(workspace::brick_of(v));
  }
  void commit() {
    ++workspace_.version;
    for (const workspace::BrickKey& key : changed_) {
      const auto octets = workspace::encode_brick(workspace_.brick(key));
      bricks_.write(to_idl(messages::WorkspaceBrick{key, workspace_.version, octets}));
    }
    changed_.clear();
    versions_.write(to_idl(messages::WorkspaceVersion{
        "cell", workspace::description_of(workspace_, workspace_.content_hash())}));
  }
  void put(std::uint16_t id, double x_m, std::uint64_t mesh_hash) {
    messages::WorkspaceObject object{
        .id = id, .name = "body", .mesh_hash = mesh_hash, .X_WO = {}, .colour = {1.0F, 0.5F, 0.0F}};
    object.X_WO.translation_m.x() = x_m;
    objects_.write(to_idl(object));
  }
  std::uint64_t put_mesh() {
    geometry::TriangleMesh mesh;
    mesh.vertices_m = {{0, 0, 0}, {0.25F, 0, 0}, {0, 0.5F, 0}, {0, 0, 1}};
    mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
    messages::MeshChunk chunk;
    chunk.mesh_hash = mesh.content_hash();
    chunk.chunk_count = 1;
    chunk.vertex_count = 4;
    chunk.triangle_count = 2;
    chunk.data = workspace::compress(geometry::mesh_bytes(mesh));
    chunks_.write(to_idl(chunk));
    return chunk.mesh_hash;
  }

 private:
  workspace::Workspace workspace_;
  std::set<workspace::BrickKey> changed_;
  dds::Writer<msg::WorkspaceBrick> bricks_;
  dds::Writer<msg::WorkspaceVersion> versions_;
  dds::Writer<msg::WorkspaceObject> objects_;
  dds::Writer<msg::MeshChunk> chunks_;
};

}  // namespace phantom::ros2::test
