#include "components/workspace_survey/dds_adapter.hpp"

#include <spdlog/spdlog.h>

#include <mutex>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/dds/endpoints/topics.hpp"
#include "common/messages/codecs/percept_codec.hpp"
#include "common/messages/codecs/teleoperation_codec.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/mesh_assembler.hpp"
#include "common/messages/object_sources.hpp"
#include "common/messages/topic_receiver.hpp"

namespace phantom::workspace_survey {
namespace {

constexpr std::size_t kMaxTriangles = std::size_t{1} << 25;  // as the viewer takes

}  // namespace

struct SystemListener::Impl {
  Impl(const core::NetworkOptions& network, const messages::ArmBounds& arm, OnState on_state)
      : participant("workspace_survey", network),
        objects_reader(participant, dds::kWorkspaceObject,
                       [this](const msg::WorkspaceObject& message, const dds::SampleInfo& info) {
                         const auto object = messages::from_idl(message);
                         if (!object) return false;
                         const std::lock_guard lock(mutex);
                         return servers.take(info.writer, *object).accepted;
                       }),
        versions_reader(
            participant, dds::kWorkspaceVersion,
            [this](const msg::WorkspaceVersion& message, const dds::SampleInfo& info) {
              if (!messages::from_idl(message)) return false;
              const std::lock_guard lock(mutex);
              return servers.commit(info.writer).accepted;
            },
            [this](const dds::GuidPrefix& server) {
              const std::lock_guard lock(mutex);
              servers.gone(server);
            }),
        chunks_reader(participant, dds::kMeshChunk,
                      [this](const msg::MeshChunk& message, const dds::SampleInfo&) {
                        auto chunk = messages::from_idl(message);
                        if (!chunk) return false;
                        const std::lock_guard lock(mutex);
                        const std::uint64_t hash = chunk->mesh_hash;
                        auto mesh = assembler.add(*std::move(chunk));
                        if (!mesh) spdlog::warn("{}", mesh.status().message());
                        if (!mesh || !*mesh) return static_cast<bool>(mesh);
                        triangles += (*mesh)->triangles.size();
                        if (triangles > kMaxTriangles) return false;
                        meshes[hash] = **std::move(mesh);
                        return true;
                      }),
        doubts_reader(participant, dds::kModelDoubt,
                      [this, arm](const msg::ModelDoubt& message, const dds::SampleInfo&) {
                        auto doubt = messages::from_idl(message, arm);
                        if (!doubt) return false;
                        const std::lock_guard lock(mutex);
                        doubts[doubt->place] = *std::move(doubt);
                        return true;
                      }),
        states_reader(participant, dds::kSlaveState, arm, std::move(on_state)) {}

  mutable std::mutex mutex;
  messages::ObjectSources servers;
  messages::MeshAssembler assembler;
  std::map<std::uint64_t, geometry::TriangleMesh> meshes;
  std::size_t triangles = 0;                             // that came in all meshes
  std::map<std::uint32_t, messages::ModelDoubt> doubts;  // by their places
  dds::Participant participant;
  dds::Reader<msg::WorkspaceObject> objects_reader;
  dds::Reader<msg::WorkspaceVersion> versions_reader;
  dds::Reader<msg::MeshChunk> chunks_reader;
  dds::Reader<msg::ModelDoubt> doubts_reader;
  messages::TopicSubscriber<msg::SlaveState> states_reader;
};

SystemListener::SystemListener(const core::NetworkOptions& network, const messages::ArmBounds& arm,
                               OnState on_state)
    : impl_(std::make_unique<Impl>(network, arm, std::move(on_state))) {}

SystemListener::~SystemListener() = default;

std::map<std::uint16_t, messages::WorkspaceObject> SystemListener::objects() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->servers.in_force();
}

std::optional<geometry::TriangleMesh> SystemListener::mesh(std::uint64_t hash) const {
  const std::lock_guard lock(impl_->mutex);
  const auto found = impl_->meshes.find(hash);
  return found == impl_->meshes.end() ? std::nullopt : std::optional(found->second);
}

std::vector<messages::ModelDoubt> SystemListener::doubts() const {
  std::vector<messages::ModelDoubt> kept;
  const std::lock_guard lock(impl_->mutex);
  for (const auto& [place, doubt] : impl_->doubts) kept.push_back(doubt);
  return kept;
}

}  // namespace phantom::workspace_survey
