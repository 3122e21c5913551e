#include "components/wva_server/dds_adapter.hpp"

#include <set>
#include <stdexcept>

#include "common/dds/endpoint.hpp"
#include "common/dds/status_reporter.hpp"
#include "common/geometry/pose.hpp"
#include "common/voxel/brick_codec.hpp"
#include "components/wva_server/mesh_chunks.hpp"
#include "phantom_idl/workspace.h"

namespace phantom::wva_server {
namespace {

constexpr std::size_t kNameBound = 64;  // idl: string<64>

msg::Vector3 to_message(const Eigen::Vector3d& v) {
  msg::Vector3 message;
  message.x(v.x());
  message.y(v.y());
  message.z(v.z());
  return message;
}

msg::Pose to_message(const geometry::Pose& X) {
  const Eigen::Vector4d q = geometry::quaternion_xyzw(X.rotation);
  msg::Pose message;
  message.position_m(to_message(X.translation_m));
  message.qx(q[0]);
  message.qy(q[1]);
  message.qz(q[2]);
  message.qw(q[3]);
  return message;
}

template <class T>
void write(dds::Writer<T>& writer, const T& sample, const char* topic) {
  if (!writer.write(sample))
    throw std::runtime_error(std::string("topic ") + topic + ": Fast DDS did not take a sample");
}

}  // namespace

struct DdsAdapter::Impl {
  explicit Impl(const core::NetworkOptions& network) : participant("wva_server", network) {}

  void publish_mesh(const geometry::TriangleMesh& mesh, std::uint64_t hash, std::size_t chunk_bytes) {
    const auto pieces = mesh_chunks(mesh, chunk_bytes);
    msg::MeshChunk message;
    message.mesh_hash(hash);
    message.chunk_count(static_cast<std::uint32_t>(pieces.size()));
    message.vertex_count(static_cast<std::uint32_t>(mesh.vertices_m.size()));
    message.triangle_count(static_cast<std::uint32_t>(mesh.triangles.size()));
    for (std::size_t i = 0; i < pieces.size(); ++i) {
      message.chunk(static_cast<std::uint32_t>(i));
      message.data(pieces[i]);
      write(chunks, message, "mesh_chunk");
    }
  }

  dds::Participant participant;
  dds::Writer<msg::WorkspaceBrick> bricks{participant, dds::kWorkspaceBrick};
  dds::Writer<msg::WorkspaceVersion> versions{participant, dds::kWorkspaceVersion};
  dds::Writer<msg::WorkspaceObject> objects{participant, dds::kWorkspaceObject};
  dds::Writer<msg::MeshChunk> chunks{participant, dds::kMeshChunk};
  dds::StatusReporter status{participant};
  std::set<voxel::BrickKey> published;
};

DdsAdapter::DdsAdapter(const core::NetworkOptions& network) : impl_(std::make_unique<Impl>(network)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::publish_objects(const runtime::CellConfig& cell, const std::vector<runtime::CellBody>& bodies,
                                 std::size_t chunk_bytes) {
  std::set<std::uint64_t> sent;
  for (const runtime::CellBody& body : bodies) {
    const runtime::ObjectConfig& object = cell.objects[body.body.id - 1U];
    const std::uint64_t hash = body.mesh_O.content_hash();
    if (sent.insert(hash).second) impl_->publish_mesh(body.mesh_O, hash, chunk_bytes);
    msg::WorkspaceObject message;
    message.id(body.body.id);
    message.name(object.name.substr(0, kNameBound));
    message.mesh_hash(hash);
    message.X_WO(to_message(object.X_WO));
    message.red(object.colour[0]);
    message.green(object.colour[1]);
    message.blue(object.colour[2]);
    write(impl_->objects, message, "workspace_object");
  }
}

void DdsAdapter::publish_workspace(const std::string& cell_name, const voxel::Workspace& workspace) {
  msg::WorkspaceBrick brick;
  const auto put_key = [&brick](voxel::BrickKey key) {
    brick.bx(key.x);
    brick.by(key.y);
    brick.bz(key.z);
  };
  const std::vector<voxel::BrickKey> keys = workspace.bricks();
  brick.version(workspace.version);
  for (const voxel::BrickKey key : keys) {
    put_key(key);
    brick.voxels_zstd(voxel::encode_brick(workspace.brick(key)));
    write(impl_->bricks, brick, "workspace_brick");
    impl_->published.erase(key);
  }
  for (const voxel::BrickKey gone : impl_->published) {
    put_key(gone);
    impl_->bricks.dispose(brick);
  }
  impl_->published = {keys.begin(), keys.end()};

  const voxel::GridSpec& grid = workspace.grid();
  msg::WorkspaceVersion version;
  version.cell(cell_name.substr(0, kNameBound));
  version.version(workspace.version);
  version.origin_m(to_message(grid.origin_m));
  version.voxel_size_m(grid.voxel_size_m);
  version.size_x_vox(static_cast<std::uint32_t>(grid.size_vox[0]));
  version.size_y_vox(static_cast<std::uint32_t>(grid.size_vox[1]));
  version.size_z_vox(static_cast<std::uint32_t>(grid.size_vox[2]));
  version.palette(workspace.palette());
  version.brick_count(static_cast<std::uint32_t>(keys.size()));
  version.content_hash(workspace.content_hash());
  write(impl_->versions, version, "workspace_version");
}

void DdsAdapter::report(const core::Health& health) { impl_->status.publish(health); }

}  // namespace phantom::wva_server
