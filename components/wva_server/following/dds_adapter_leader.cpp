#include "components/wva_server/following/dds_adapter_leader.hpp"

#include <map>
#include <mutex>

#include "common/dds/endpoints/endpoint.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/messages/mesh_assembler.hpp"
#include "common/messages/object_sources.hpp"

namespace phantom::wva_server {
namespace {

core::NetworkOptions in_partition(core::NetworkOptions network, const std::string& partition) {
  network.partition = partition;
  return network;
}

}  // namespace

struct LeaderAdapter::Impl {
  Impl(core::NetworkOptions network, const std::string& partition)
      : participant("wva_server", in_partition(std::move(network), partition)) {}

  bool on_uncertainty(const msg::ObjectUncertainty& message, const dds::SampleInfo& info);
  bool on_mesh_chunk(const msg::MeshChunk& message);
  bool on_object(const msg::WorkspaceObject& message, const dds::SampleInfo& info);
  bool on_version(const msg::WorkspaceVersion& message, const dds::SampleInfo& info);
  void on_server_gone(const dds::GuidPrefix& server);
  void apply(const std::vector<messages::WorkspaceObject>& changes);
  LeaderObjects put_together() const;

  mutable std::mutex mutex;
  messages::ObjectSources sources;                             // guarded by mutex, as all below
  std::map<std::uint16_t, messages::WorkspaceObject> objects;  // of the server in force, with removed ones
  std::map<dds::GuidPrefix, std::map<std::uint16_t, double>> errors_m;
  messages::MeshAssembler assembler;
  std::map<std::uint64_t, geometry::TriangleMesh> meshes;
  bool changed = false;
  dds::Participant participant;
  // Declared last, so that their callbacks end before the members that they use are destroyed.
  dds::Reader<msg::ObjectUncertainty> uncertainty_reader{
      participant, dds::kObjectUncertainty,
      [this](const msg::ObjectUncertainty& message, const dds::SampleInfo& info) {
        return on_uncertainty(message, info);
      }};
  dds::Reader<msg::MeshChunk> chunk_reader{
      participant, dds::kMeshChunk,
      [this](const msg::MeshChunk& message, const dds::SampleInfo&) { return on_mesh_chunk(message); }};
  dds::Reader<msg::WorkspaceObject> object_reader{
      participant, dds::kWorkspaceObject,
      [this](const msg::WorkspaceObject& message, const dds::SampleInfo& info) {
        return on_object(message, info);
      }};
  dds::Reader<msg::WorkspaceVersion> version_reader{
      participant, dds::kWorkspaceVersion,
      [this](const msg::WorkspaceVersion& message, const dds::SampleInfo& info) {
        return on_version(message, info);
      },
      [this](const dds::GuidPrefix& server) { on_server_gone(server); }};
};

bool LeaderAdapter::Impl::on_uncertainty(const msg::ObjectUncertainty& message, const dds::SampleInfo& info) {
  const auto sample = messages::from_idl(message);
  if (!sample) return false;
  const std::lock_guard lock(mutex);
  errors_m[info.writer][sample->id] = sample->pose_error_m;
  changed = true;
  return true;
}

bool LeaderAdapter::Impl::on_mesh_chunk(const msg::MeshChunk& message) {
  const auto sample = messages::from_idl(message);
  if (!sample) return false;
  const std::lock_guard lock(mutex);
  const std::uint64_t hash = sample->mesh_hash;
  if (meshes.contains(hash)) return true;
  auto mesh = assembler.add(*sample);
  if (!mesh) return false;
  if (*mesh) meshes[hash] = std::move(**mesh);
  changed = true;
  return true;
}

bool LeaderAdapter::Impl::on_object(const msg::WorkspaceObject& message, const dds::SampleInfo& info) {
  const auto sample = messages::from_idl(message);
  if (!sample) return false;
  const std::lock_guard lock(mutex);
  const auto taken = sources.take(info.writer, *sample);
  apply(taken.changes);
  return taken.accepted;
}

bool LeaderAdapter::Impl::on_version(const msg::WorkspaceVersion& message, const dds::SampleInfo& info) {
  auto version = messages::from_idl(message);
  if (!version) return false;
  const std::lock_guard lock(mutex);
  const auto before = sources.server();
  apply(sources.commit(info.writer, *std::move(version)).changes);
  if (before && before != sources.server()) errors_m.erase(*before);
  changed = true;
  return true;
}

void LeaderAdapter::Impl::on_server_gone(const dds::GuidPrefix& server) {
  const std::lock_guard lock(mutex);
  apply(sources.gone(server));
  if (server != sources.server()) errors_m.erase(server);
  changed = true;
}

void LeaderAdapter::Impl::apply(const std::vector<messages::WorkspaceObject>& changes) {
  for (const messages::WorkspaceObject& object : changes) objects[object.id] = object;
  changed = changed || !changes.empty();
}

LeaderObjects LeaderAdapter::Impl::put_together() const {
  LeaderObjects all;
  for (const auto& [id, object] : objects) all[id].object = object;
  if (const auto known = errors_m.find(*sources.server()); known != errors_m.end())
    for (const auto& [id, error_m] : known->second)
      if (const auto object = all.find(id); object != all.end()) object->second.pose_error_m = error_m;
  for (const messages::CarriedObject& one : sources.carried())
    if (const auto object = all.find(one.id); object != all.end()) object->second.carried = one;
  return all;
}

LeaderAdapter::LeaderAdapter(core::NetworkOptions network, const std::string& partition)
    : impl_(std::make_unique<Impl>(std::move(network), partition)) {}
LeaderAdapter::~LeaderAdapter() = default;

std::optional<LeaderObjects> LeaderAdapter::take() {
  const std::lock_guard lock(impl_->mutex);
  if (!impl_->sources.server() || !impl_->changed) return std::nullopt;
  impl_->changed = false;
  return impl_->put_together();
}

bool LeaderAdapter::is_heard() const {
  const std::lock_guard lock(impl_->mutex);
  return impl_->sources.server().has_value();
}

const geometry::TriangleMesh* LeaderAdapter::mesh(std::uint64_t hash) const {
  const std::lock_guard lock(impl_->mutex);
  const auto found = impl_->meshes.find(hash);
  return found == impl_->meshes.end() ? nullptr : &found->second;  // meshes are never erased
}

}  // namespace phantom::wva_server
