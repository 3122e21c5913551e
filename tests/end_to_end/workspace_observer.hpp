#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <set>

#include "common/core/clock.hpp"
#include "common/dds/endpoint.hpp"
#include "common/voxel/workspace_assembler.hpp"

namespace phantom::end_to_end {

/// One more participant that follows the workspace and the percepts that rest on it.
class WorkspaceObserver {
 public:
  explicit WorkspaceObserver(const core::NetworkOptions& network)
      : participant_("workspace_observer", network) {}

  /// The newest whole version; null before the first.
  std::shared_ptr<const voxel::Workspace> workspace() {
    const std::lock_guard lock(mutex_);
    return assembler_.current();
  }
  std::uint64_t version() {
    const auto current = workspace();
    return current ? current->version : 0;
  }
  msg::Percept percept() {
    const std::lock_guard lock(mutex_);
    return percept_;
  }
  /// The workspace version that the newest percept rests on, and the process session that it came from; 0:
  /// none yet.
  std::uint64_t felt_version() {
    const std::lock_guard lock(mutex_);
    return percept_.workspace_version();
  }
  std::uint64_t felt_by() {
    const std::lock_guard lock(mutex_);
    return percept_.stamp().session();
  }
  /// Every version that percepts rested on.
  std::set<std::uint64_t> felt_versions() {
    const std::lock_guard lock(mutex_);
    std::set<std::uint64_t> versions;
    for (const auto& [version, at_ns] : felt_ns_) versions.insert(version);
    return versions;
  }
  /// From the arrival of a version to the first percept that rests on it, seconds; less than none if it never
  /// came.
  std::optional<double> delay_s(std::uint64_t version) {
    const std::lock_guard lock(mutex_);
    if (!committed_ns_.contains(version) || !felt_ns_.contains(version)) return std::nullopt;
    return core::seconds(felt_ns_[version] - committed_ns_[version]);
  }
  /// Makes the next version cheap for the observer: it must not hold up the percepts whose delay it measures.
  void make_ready() {
    const std::lock_guard lock(mutex_);
    assembler_.prepare();
  }
  /// Bricks that came since the last call, by version.
  std::map<voxel::BrickKey, std::uint64_t> take_bricks() {
    const std::lock_guard lock(mutex_);
    return std::exchange(bricks_, {});
  }
  std::size_t bricks_heard() {
    const std::lock_guard lock(mutex_);
    return bricks_.size();
  }
  std::map<std::uint16_t, msg::WorkspaceObject> objects() {
    const std::lock_guard lock(mutex_);
    return objects_;
  }
  std::uint16_t id_of(const std::string& name) {
    for (const auto& [id, object] : objects()) {
      if (object.name() == name) return id;
    }
    return 0;
  }
  /// Readers of workspace_brick that wva_server has now, as it says itself.
  std::uint32_t brick_readers() {
    const std::lock_guard lock(mutex_);
    return brick_readers_;
  }

 private:
  template <class T, class Take>
  typename dds::Reader<T>::OnSample under_lock(Take take) {
    return [this, take](const T& sample, const dds::SampleInfo& info) {
      const std::lock_guard lock(mutex_);
      take(sample, info.received_ns);
    };
  }
  void commit(const msg::WorkspaceVersion& v, core::Nanoseconds at_ns) {
    voxel::VersionDescription d;
    d.version = v.version();
    d.grid = {{v.origin_m().x(), v.origin_m().y(), v.origin_m().z()},
              v.voxel_size_m(),
              {static_cast<int>(v.size_x_vox()), static_cast<int>(v.size_y_vox()),
               static_cast<int>(v.size_z_vox())}};
    d.palette_Pa_s_per_m = v.palette();
    d.brick_count = v.brick_count();
    d.content_hash = v.content_hash();
    committed_ns_.emplace(v.version(), at_ns);
    if (!assembler_.commit(d)) throw std::runtime_error("a version that contradicts itself");
  }

  std::mutex mutex_;
  voxel::WorkspaceAssembler assembler_;
  std::map<voxel::BrickKey, std::uint64_t> bricks_;
  std::map<std::uint64_t, core::Nanoseconds> committed_ns_, felt_ns_;
  msg::Percept percept_;
  std::map<std::uint16_t, msg::WorkspaceObject> objects_;
  std::uint32_t brick_readers_ = 0;
  dds::Participant participant_;
  dds::Reader<msg::WorkspaceBrick> brick_reader_{
      participant_, dds::kWorkspaceBrick,
      under_lock<msg::WorkspaceBrick>([this](const auto& b, core::Nanoseconds) {
        bricks_[{b.bx(), b.by(), b.bz()}] = b.version();
        if (!assembler_.put_brick({b.bx(), b.by(), b.bz()}, b.version(), b.voxels_zstd()))
          throw std::runtime_error("a brick that is none");
      })};
  dds::Reader<msg::WorkspaceVersion> version_reader_{
      participant_, dds::kWorkspaceVersion,
      under_lock<msg::WorkspaceVersion>(
          [this](const auto& v, core::Nanoseconds at_ns) { commit(v, at_ns); })};
  dds::Reader<msg::Percept> percept_reader_{
      participant_, dds::kPercept, under_lock<msg::Percept>([this](const auto& p, core::Nanoseconds at_ns) {
        percept_ = p;
        if (p.workspace_version() != 0) felt_ns_.emplace(p.workspace_version(), at_ns);
      })};
  dds::Reader<msg::WorkspaceObject> object_reader_{
      participant_, dds::kWorkspaceObject,
      under_lock<msg::WorkspaceObject>([this](const auto& o, core::Nanoseconds) {
        objects_[o.id()] = o;
        if (o.mesh_hash() == 0) objects_.erase(o.id());
      })};
  dds::Reader<msg::ComponentStatus> status_reader_{
      participant_, dds::kComponentStatus,
      under_lock<msg::ComponentStatus>([this](const auto& s, core::Nanoseconds) {
        if (s.component_name() != "wva_server") return;
        for (const auto& topic : s.topics()) {
          if (topic.writer() && topic.topic() == "workspace_brick") brick_readers_ = topic.matched();
        }
      })};
};

}  // namespace phantom::end_to_end
