#include "components/wva_server/dds_adapter.hpp"

#include <algorithm>
#include <mutex>
#include <set>
#include <span>
#include <stdexcept>

#include "common/core/parallel.hpp"
#include "common/dds/endpoint.hpp"
#include "common/dds/status_reporter.hpp"
#include "common/voxel/brick_codec.hpp"
#include "components/wva_server/dds_adapter_convert.hpp"
#include "components/wva_server/mesh_chunks.hpp"

namespace phantom::wva_server {
namespace {

constexpr std::size_t kBricksAtOnce = 1024;  // encoded before they are written: bounds the memory

template <class T>
void write(dds::Writer<T>& writer, const T& sample, const char* topic) {
  if (!writer.write(sample))
    throw std::runtime_error(std::string("topic ") + topic + ": Fast DDS did not take a sample");
}

}  // namespace

struct DdsAdapter::Impl {
  Impl(const core::NetworkOptions& network, bool accept)
      : accept_commands(accept), participant("wva_server", network) {}

  void publish_mesh(const ServedObject& object, std::size_t chunk_bytes);
  void take_in(const msg::WorkspaceCommand& message);
  void send(const Request& request, const Reply& reply);

  bool accept_commands;
  dds::Participant participant;
  dds::Writer<msg::WorkspaceBrick> bricks{participant, dds::kWorkspaceBrick};
  dds::Writer<msg::WorkspaceVersion> versions{participant, dds::kWorkspaceVersion};
  dds::Writer<msg::WorkspaceObject> objects{participant, dds::kWorkspaceObject};
  dds::Writer<msg::MeshChunk> chunks{participant, dds::kMeshChunk};
  dds::StatusReporter status{participant};
  std::set<std::uint64_t> meshes;  // published, by content hash

  CommandDesk desk;
  std::mutex sending;  // replies come from the reader's thread, too
  dds::Stamper stamper{participant};
  dds::Writer<msg::WorkspaceReply> replies{participant, dds::kWorkspaceReply};
  // Last: its callback uses what stands above.
  dds::Reader<msg::WorkspaceCommand> commands{
      participant, dds::kWorkspaceCommand,
      [this](const msg::WorkspaceCommand& message, const dds::SampleInfo&) { take_in(message); }};
};

void DdsAdapter::Impl::publish_mesh(const ServedObject& object, std::size_t chunk_bytes) {
  const auto pieces = mesh_chunks(object.mesh_O, chunk_bytes);
  msg::MeshChunk message;
  message.mesh_hash(object.mesh_hash);
  message.chunk_count(static_cast<std::uint32_t>(pieces.size()));
  message.vertex_count(static_cast<std::uint32_t>(object.mesh_O.vertices_m.size()));
  message.triangle_count(static_cast<std::uint32_t>(object.mesh_O.triangles.size()));
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    message.chunk(static_cast<std::uint32_t>(i));
    message.data(pieces[i]);
    write(chunks, message, "mesh_chunk");
  }
  meshes.insert(object.mesh_hash);
}

void DdsAdapter::Impl::take_in(const msg::WorkspaceCommand& message) {
  Request request = to_request(message);
  Reply reply;
  reply.outcome = Outcome::kRefused;
  reply.object = request.command.object;
  reply.message = refusal(message);
  if (reply.message.empty() && !accept_commands)
    reply.message = "this wva_server takes no commands (accept_commands is false in its configuration)";
  if (reply.message.empty()) reply = desk.take_in(request);
  send(request, reply);
}

void DdsAdapter::Impl::send(const Request& request, const Reply& reply) {
  msg::WorkspaceReply message = to_message(request, reply);
  const std::lock_guard lock(sending);
  message.stamp(stamper.next());
  replies.write(message);  // who does not hear it asks again
}

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, bool accept_commands)
    : impl_(std::make_unique<Impl>(network, accept_commands)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::publish_object(const ServedObject& object, std::size_t chunk_bytes) {
  if (!impl_->meshes.contains(object.mesh_hash)) impl_->publish_mesh(object, chunk_bytes);
  write(impl_->objects, to_message(object), "workspace_object");
}

void DdsAdapter::withdraw_object(std::uint16_t id) {
  msg::WorkspaceObject message;
  message.id(id);
  message.mesh_hash(0);
  write(impl_->objects, message, "workspace_object");
}

void DdsAdapter::publish_change(const LiveCell& cell, const voxel::WorkspaceChange& change, int threads) {
  msg::WorkspaceBrick brick;
  const auto put_key = [&brick](voxel::BrickKey key) {
    brick.bx(key.x);
    brick.by(key.y);
    brick.bz(key.z);
  };
  brick.version(change.version);
  std::vector<std::vector<std::uint8_t>> encoded(std::min(kBricksAtOnce, change.changed.size()));
  for (std::size_t first = 0; first < change.changed.size(); first += kBricksAtOnce) {
    const auto keys =
        std::span(change.changed).subspan(first, std::min(kBricksAtOnce, change.changed.size() - first));
    core::parallel_for(threads, keys.size(), [&](std::size_t i, std::size_t) {
      encoded[i] = voxel::encode_brick(cell.workspace().brick(keys[i]));
    });
    for (std::size_t i = 0; i < keys.size(); ++i) {
      put_key(keys[i]);
      brick.voxels_zstd(std::move(encoded[i]));
      write(impl_->bricks, brick, "workspace_brick");
    }
  }
  brick.voxels_zstd({});
  for (const voxel::BrickKey key : change.removed) {
    put_key(key);
    write(impl_->bricks, brick, "workspace_brick");
  }
  write(impl_->versions, version_message(cell.cell().name, cell.workspace(), cell.content_hash()),
        "workspace_version");
}

void DdsAdapter::report(const core::Health& health) { impl_->status.publish(health); }

std::optional<Request> DdsAdapter::next_command(double wait_s) { return impl_->desk.next(wait_s); }

void DdsAdapter::reply(const Request& request, const Reply& reply) {
  impl_->desk.replied(request.id, reply);
  impl_->send(request, reply);
}

}  // namespace phantom::wva_server
