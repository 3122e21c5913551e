#include "components/wva_server/dds_adapter.hpp"

#include <algorithm>
#include <map>
#include <mutex>
#include <set>
#include <span>
#include <stdexcept>

#include "common/core/parallel.hpp"
#include "common/core/snapshot.hpp"
#include "common/dds/admission/source_guard.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/command_service.hpp"
#include "common/messages/request_log.hpp"
#include "common/messages/status_reporter.hpp"
#include "common/messages/topic_receiver.hpp"
#include "common/workspace/brick_codec.hpp"
#include "components/wva_server/mesh_chunks.hpp"

namespace phantom::wva_server {
namespace {

// Encoded before any of them is written: bounds the memory, and how long nobody is asked whether it goes on.
constexpr std::size_t kBricksAtOnce = 128;

template <class T>
void write(dds::Writer<T>& writer, const T& sample, const char* topic) {
  if (!writer.write(sample))
    throw std::runtime_error(std::string("topic ") + topic + ": Fast DDS did not take a sample");
}

using messages::WorkspaceCommand;
using messages::WorkspaceOutcome;
using messages::WorkspaceReply;
using Commands = messages::CommandService<WorkspaceCommand, WorkspaceReply>;

/// Returns a reply before the command is carried out, or instead of that.
WorkspaceReply reply_to(const WorkspaceCommand& command, WorkspaceOutcome outcome,
                        const std::string& message) {
  return {.requester = command.requester,
          .operation = command.operation,
          .object = command.object,
          .id = command.id,
          .outcome = outcome,
          .message = message};
}

Commands::Rules rules(const std::string& refusal) {
  return {
      .refusal = [refusal](const WorkspaceCommand&) { return refusal; },
      .refused = [](const WorkspaceCommand& command,
                    const std::string& why) { return reply_to(command, WorkspaceOutcome::kRefused, why); },
      .accepted =
          [](const WorkspaceCommand& command, std::size_t before) {
            return reply_to(command, WorkspaceOutcome::kAccepted,
                            before == 0 ? "is being carried out"
                                        : "waits for " + std::to_string(before) + " commands before it");
          }};
}

}  // namespace

struct DdsAdapter::Impl {
  Impl(const core::NetworkOptions& network, const std::string& refusal)
      : participant("wva_server", network),
        commands(participant, dds::kWorkspaceCommand, dds::kWorkspaceReply, rules(refusal)) {}

  void publish_mesh(const ServedObject& object, std::size_t chunk_bytes);

  dds::Participant participant;
  dds::Writer<msg::WorkspaceBrick> bricks{participant, dds::kWorkspaceBrick};
  dds::Writer<msg::WorkspaceVersion> versions{participant, dds::kWorkspaceVersion};
  dds::Writer<msg::WorkspaceObject> objects{participant, dds::kWorkspaceObject};
  dds::Writer<msg::ObjectUncertainty> uncertainties{participant, dds::kObjectUncertainty};
  dds::Writer<msg::LiveObject> live_objects{participant, dds::kLiveObject};
  dds::Writer<msg::MeshChunk> chunks{participant, dds::kMeshChunk};
  messages::StatusReporter status{participant};
  std::map<std::uint16_t, std::uint64_t> meshes;  // content hash of the mesh of each published object
  Commands commands;
  core::LogRate done_rate, refused_rate;
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
  core::Snapshot<ArmSample> newest_arm;
  core::Snapshot<GripperSample> newest_gripper;
  std::unique_ptr<messages::TopicSubscriber<msg::SlaveState>> arm_states;
  std::unique_ptr<messages::TopicSubscriber<msg::GripperState>> gripper_states;
  mutable std::mutex intake_mutex;
  LiveIntake intake;  // guarded by intake_mutex
  std::unique_ptr<messages::TopicSubscriber<msg::OccupancyChange>> occupancies;
};

void DdsAdapter::Impl::publish_mesh(const ServedObject& object, std::size_t chunk_bytes) {
  const auto pieces = mesh_chunks(object.mesh_O, chunk_bytes);
  messages::MeshChunk chunk{.mesh_hash = object.mesh_hash,
                            .chunk_count = static_cast<std::uint32_t>(pieces.size()),
                            .vertex_count = static_cast<std::uint32_t>(object.mesh_O.vertices_m.size()),
                            .triangle_count = static_cast<std::uint32_t>(object.mesh_O.triangles.size())};
  for (const auto& piece : pieces) {
    chunk.data = piece;
    write(chunks, messages::to_idl(chunk), "mesh_chunk");
    ++chunk.chunk;
  }
}

DdsAdapter::DdsAdapter(const core::NetworkOptions& network, const std::string& refusal)
    : impl_(std::make_unique<Impl>(network, refusal)) {}
DdsAdapter::~DdsAdapter() = default;

void DdsAdapter::publish_object(const ServedObject& object, std::size_t chunk_bytes) {
  // A mesh that no object has for a while is dropped by viewers: it is sent again with the next that has it.
  const bool is_known = std::ranges::any_of(
      impl_->meshes, [&object](const auto& known) { return known.second == object.mesh_hash; });
  if (!is_known) impl_->publish_mesh(object, chunk_bytes);
  impl_->meshes[object.id] = object.mesh_hash;
  const double error_m = object.config.pose_error_m;
  const messages::ObjectUncertainty uncertainty{object.id, error_m > 0.0 ? error_m : -1.0, object.guard_m};
  write(impl_->uncertainties, messages::to_idl(uncertainty), "object_uncertainty");
  const messages::WorkspaceObject sample{object.id, object.config.name, object.mesh_hash, object.config.X_WO,
                                         object.config.colour};
  write(impl_->objects, messages::to_idl(sample), "workspace_object");
}

void DdsAdapter::withdraw_object(std::uint16_t id) {
  impl_->meshes.erase(id);
  write(impl_->objects, messages::to_idl(messages::WorkspaceObject{.id = id}), "workspace_object");
}

void DdsAdapter::publish_live(const messages::LiveObject& object) {
  write(impl_->live_objects, messages::to_idl(object), "live_object");
}

void DdsAdapter::follow(const robot::SerialArm& arm) {
  impl_->arm_states = std::make_unique<messages::TopicSubscriber<msg::SlaveState>>(
      impl_->participant, dds::kSlaveState, messages::bounds_of(arm), impl_->newest_arm);
}

void DdsAdapter::follow_gripper() {
  impl_->gripper_states = std::make_unique<messages::TopicSubscriber<msg::GripperState>>(
      impl_->participant, dds::kGripperState, messages::ArmBounds(), impl_->newest_gripper);
}

void DdsAdapter::follow_occupancy(const std::string& source, const std::string& cell,
                                  const workspace::GridSpec& grid) {
  const auto refusal = [source, cell, grid](const messages::OccupancyChange& change) -> std::string {
    if (change.source != source) return "it is of '" + change.source + "'; allowed: '" + source + "'";
    const workspace::GridSpec& its = change.grid;
    const bool same = change.cell == cell && its.origin_m == grid.origin_m &&
                      its.voxel_size_m == grid.voxel_size_m && its.size_vox == grid.size_vox;
    return same ? "" : "it is of another cell or grid than this server's; allowed: the same cell file";
  };
  impl_->occupancies = std::make_unique<messages::TopicSubscriber<msg::OccupancyChange>>(
      impl_->participant, dds::kOccupancyChange,
      messages::TopicReceiver<msg::OccupancyChange>(messages::ArmBounds(), {.refusal = refusal}),
      [this](const messages::Received<messages::OccupancyChange>& sample) {
        const std::lock_guard lock(impl_->intake_mutex);
        impl_->intake.put(sample, sample.received_ns);
      });
}

LiveInput DdsAdapter::occupancy() const {
  const bool has_rival = impl_->occupancies && impl_->occupancies->source().has_second(core::monotonic_ns());
  const std::lock_guard lock(impl_->intake_mutex);
  return {impl_->intake.waiting(), impl_->intake.received_ns(), impl_->intake.cameras(), has_rival};
}

std::optional<LiveIntake::Taken> DdsAdapter::take_occupancy() {
  const std::lock_guard lock(impl_->intake_mutex);
  return impl_->intake.take();
}

void DdsAdapter::restart_occupancy() {
  const std::lock_guard lock(impl_->intake_mutex);
  impl_->intake.restart();
}

bool DdsAdapter::newest_gripper(GripperSample& sample) { return impl_->newest_gripper.read(sample); }

bool DdsAdapter::newest_arm(ArmSample& sample) { return impl_->newest_arm.read(sample); }

bool DdsAdapter::publish_change(const LiveCell& cell, const layers::WorkspaceChange& change, int threads,
                                const std::function<bool()>& go_on) {
  const auto write_brick = [&](workspace::BrickKey key, std::span<const std::uint8_t> voxels) {
    write(impl_->bricks, messages::to_idl(messages::WorkspaceBrick{key, change.version, voxels}),
          "workspace_brick");
  };
  std::vector<std::vector<std::uint8_t>> encoded(std::min(kBricksAtOnce, change.changed.size()));
  for (std::size_t first = 0; first < change.changed.size(); first += kBricksAtOnce) {
    if (first > 0 && go_on && !go_on()) return false;
    const auto keys =
        std::span(change.changed).subspan(first, std::min(kBricksAtOnce, change.changed.size() - first));
    core::parallel_for(threads, keys.size(), [&](std::size_t i, std::size_t) {
      encoded[i] = workspace::encode_brick(cell.workspace().brick(keys[i]));
    });
    for (std::size_t i = 0; i < keys.size(); ++i) write_brick(keys[i], encoded[i]);
  }
  for (std::size_t i = 0; i < change.removed.size(); ++i) {
    if (i % kBricksAtOnce == 0 && go_on && !go_on()) return false;
    write_brick(change.removed[i], {});
  }
  const messages::WorkspaceVersion version{
      cell.cell().name, workspace::description_of(cell.workspace(), cell.content_hash()), cell.carried()};
  write(impl_->versions, messages::to_idl(version), "workspace_version");
  return true;
}

bool DdsAdapter::has_rival() const {
  const std::lock_guard lock(impl_->others_mutex);
  return !impl_->others.empty();
}

void DdsAdapter::report(const core::Health& health) {
  impl_->status.publish(has_rival() ? dds::with_rival(health, "workspace_version") : health);
}

std::optional<WorkspaceCommand> DdsAdapter::next_command(double wait_s) {
  return impl_->commands.next(wait_s);
}

void DdsAdapter::notify(const WorkspaceCommand& command, const std::string& message) {
  impl_->commands.notify(command.stamp, reply_to(command, WorkspaceOutcome::kAccepted, message));
}

void DdsAdapter::reply(const WorkspaceCommand& command, WorkspaceReply reply) {
  reply.requester = command.requester;
  reply.operation = command.operation;
  impl_->commands.complete(command.stamp, std::move(reply));
}

bool DdsAdapter::is_logged(WorkspaceOutcome outcome) {
  return outcome == WorkspaceOutcome::kRefused
             ? messages::is_logged(impl_->refused_rate, "refused workspace changes")
             : messages::is_logged(impl_->done_rate, "workspace changes");
}

}  // namespace phantom::wva_server
