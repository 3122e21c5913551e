#include "components/wva_server/dds_adapter.hpp"

#include <algorithm>
#include <mutex>
#include <set>
#include <span>
#include <stdexcept>

#include "common/core/parallel.hpp"
#include "common/dds/command_service.hpp"
#include "common/dds/source_guard.hpp"
#include "common/dds/status_reporter.hpp"
#include "common/workspace/brick_codec.hpp"
#include "components/wva_server/dds_adapter_convert.hpp"
#include "components/wva_server/mesh_chunks.hpp"

namespace phantom::wva_server {
namespace {

constexpr std::size_t kBricksAtOnce = 1024;  // encoded before any of them is written; bounds the memory

template <class T>
void write(dds::Writer<T>& writer, const T& sample, const char* topic) {
  if (!writer.write(sample))
    throw std::runtime_error(std::string("topic ") + topic + ": Fast DDS did not take a sample");
}

using Commands = dds::CommandService<msg::WorkspaceCommand, msg::WorkspaceReply>;

msg::WorkspaceReply at_once(const msg::WorkspaceCommand& command, Outcome outcome,
                            const std::string& message) {
  const Request request = to_request(command);
  Reply reply;
  reply.outcome = outcome;
  reply.object = request.command.object;
  reply.object_id = request.command.id;
  reply.message = message;
  return to_message(request, reply);
}

Commands::Rules rules(bool accept_commands) {
  return {.refusal =
              [accept_commands](const msg::WorkspaceCommand& command) {
                std::string why = refusal(command);
                if (why.empty() && !accept_commands)
                  why = "this wva_server takes no commands (accept_commands is false in its configuration)";
                return why;
              },
          .refused = [](const msg::WorkspaceCommand& command,
                        const std::string& why) { return at_once(command, Outcome::kRefused, why); },
          .accepted =
              [](const msg::WorkspaceCommand& command, std::size_t before) {
                return at_once(
                    command, Outcome::kAccepted,
                    before == 0 ? "taken up" : "waits for " + std::to_string(before) + " commands before it");
              }};
}

}  // namespace

struct DdsAdapter::Impl {
  Impl(const core::NetworkOptions& network, bool accept)
      : participant("wva_server", network),
        commands(participant, dds::kWorkspaceCommand, dds::kWorkspaceReply, rules(accept)) {}

  void publish_mesh(const ServedObject& object, std::size_t chunk_bytes);

  dds::Participant participant;
  dds::Writer<msg::WorkspaceBrick> bricks{participant, dds::kWorkspaceBrick};
  dds::Writer<msg::WorkspaceVersion> versions{participant, dds::kWorkspaceVersion};
  dds::Writer<msg::WorkspaceObject> objects{participant, dds::kWorkspaceObject};
  dds::Writer<msg::MeshChunk> chunks{participant, dds::kMeshChunk};
  dds::StatusReporter status{participant};
  std::set<std::uint64_t> meshes;  // content hashes of the published meshes
  Commands commands;
  mutable std::mutex others_mutex;
  std::set<dds::GuidPrefix> others;  // other processes that publish a workspace
  dds::Reader<msg::WorkspaceVersion> other_versions{
      participant, dds::kWorkspaceVersion,
      [this](const msg::WorkspaceVersion&, const dds::SampleInfo& info) {
        if (info.writer == dds::prefix_of(participant)) return;
        const std::lock_guard lock(others_mutex);
        others.insert(info.writer);
      },
      [this](const dds::GuidPrefix& server) {
        const std::lock_guard lock(others_mutex);
        others.erase(server);
      }};
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

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, bool accept_commands)
    : impl_(std::make_unique<Impl>(network, accept_commands)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::publish_object(const ServedObject& object, std::size_t chunk_bytes) {
  if (!impl_->meshes.contains(object.mesh_hash)) impl_->publish_mesh(object, chunk_bytes);
  const messages::WorkspaceObject told{object.id, object.config.name, object.mesh_hash, object.config.X_WO,
                                       object.config.colour};
  write(impl_->objects, messages::to_idl(told), "workspace_object");
}

void DdsAdapter::withdraw_object(std::uint16_t id) {
  write(impl_->objects, messages::to_idl(messages::WorkspaceObject{.id = id}), "workspace_object");
}

void DdsAdapter::publish_change(const LiveCell& cell, const layers::WorkspaceChange& change, int threads) {
  msg::WorkspaceBrick brick;
  const auto put_key = [&brick](workspace::BrickKey key) {
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
      encoded[i] = workspace::encode_brick(cell.workspace().brick(keys[i]));
    });
    for (std::size_t i = 0; i < keys.size(); ++i) {
      put_key(keys[i]);
      brick.voxels_zstd(std::move(encoded[i]));
      write(impl_->bricks, brick, "workspace_brick");
    }
  }
  brick.voxels_zstd({});
  for (const workspace::BrickKey key : change.removed) {
    put_key(key);
    write(impl_->bricks, brick, "workspace_brick");
  }
  write(impl_->versions, version_message(cell.cell().name, cell.workspace(), cell.content_hash()),
        "workspace_version");
}

bool DdsAdapter::has_rival() const {
  const std::lock_guard lock(impl_->others_mutex);
  return !impl_->others.empty();
}

void DdsAdapter::report(const core::Health& health) {
  impl_->status.publish(has_rival() ? dds::with_rival(health, "workspace_version") : health);
}

std::optional<Request> DdsAdapter::next_command(double wait_s) {
  const auto command = impl_->commands.next(wait_s);
  return command ? std::optional(to_request(*command)) : std::nullopt;
}

void DdsAdapter::reply(const Request& request, const Reply& reply) {
  impl_->commands.complete(request.id, to_message(request, reply));
}

}  // namespace phantom::wva_server
