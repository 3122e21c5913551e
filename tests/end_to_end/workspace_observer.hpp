#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <vector>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/messages/codecs/workspace_codec.hpp"
#include "common/workspace/workspace_assembler.hpp"

namespace phantom::end_to_end {

/// One more participant that follows the workspace and the percepts that rest on it.
class WorkspaceObserver {
 public:
  explicit WorkspaceObserver(const core::NetworkOptions& network)
      : participant_("workspace_observer", network) {}

  /// The newest whole version; null before the first.
  std::shared_ptr<const workspace::Workspace> workspace() {
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
    for (const auto& [version, first] : felt_) versions.insert(version);
    return versions;
  }
  /// How long a version took from its arrival to the first percept that rests on it, and how much of that the
  /// threads of whom watch() names waited for a processor, summed up.
  struct Delay {
    double all_s = 0.0, without_processor_s = 0.0;
  };
  /// None if the version or the percept never came.
  std::optional<Delay> delay(std::uint64_t version) {
    const std::lock_guard lock(mutex_);
    const auto committed = committed_.find(version), felt = felt_.find(version);
    if (committed == committed_.end() || felt == felt_.end()) return std::nullopt;
    return Delay{core::seconds(felt->second.at_ns - committed->second.at_ns),
                 felt->second.waited_s - committed->second.waited_s};
  }
  /// When the first percept came that rests on a version, by the monotonic clock; 0: none has come.
  core::Nanoseconds felt_at_ns(std::uint64_t version) {
    const std::lock_guard lock(mutex_);
    const auto felt = felt_.find(version);
    return felt == felt_.end() ? 0 : felt->second.at_ns;
  }
  /// What arms carry in the newest committed version.
  std::vector<messages::CarriedObject> carried() {
    const std::lock_guard lock(mutex_);
    return carried_;
  }
  /// From now on these threads' waiting for a processor is noted with each version and first percept.
  void watch(std::vector<std::filesystem::path> schedstat_files) {
    const std::lock_guard lock(mutex_);
    watched_ = std::move(schedstat_files);
  }
  /// Makes the next version cheap for the observer: it must not hold up the percepts whose delay it measures.
  void make_ready() {
    const std::lock_guard lock(mutex_);
    assembler_.prepare();
  }
  /// Bricks that came since the last call, by version.
  std::map<workspace::BrickKey, std::uint64_t> take_bricks() {
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
    const auto version = messages::from_idl(v);
    if (!version) throw std::runtime_error(version.status().message());
    committed_.try_emplace(v.version(), Noted{at_ns, waited_s()});
    if (!assembler_.commit(version->description))
      throw std::runtime_error("a version that contradicts itself");
    carried_ = version->carried;
  }

  struct Noted {
    core::Nanoseconds at_ns = 0;
    double waited_s = 0.0;
  };
  /// What the kernel has counted (Documentation/scheduler/sched-stats: the second number).
  double waited_s() const {
    double sum_s = 0.0;
    for (const auto& file : watched_) {
      std::ifstream stream(file);
      core::Nanoseconds ran_ns = 0, waited_ns = 0;
      if (stream >> ran_ns >> waited_ns) sum_s += core::seconds(waited_ns);
    }
    return sum_s;
  }

  std::mutex mutex_;
  workspace::WorkspaceAssembler assembler_;
  std::map<workspace::BrickKey, std::uint64_t> bricks_;
  std::vector<std::filesystem::path> watched_;
  std::map<std::uint64_t, Noted> committed_, felt_;
  std::vector<messages::CarriedObject> carried_;
  msg::Percept percept_;
  std::map<std::uint16_t, msg::WorkspaceObject> objects_;
  std::uint32_t brick_readers_ = 0;
  dds::Participant participant_;
  dds::Reader<msg::WorkspaceBrick> brick_reader_{
      participant_, dds::kWorkspaceBrick,
      under_lock<msg::WorkspaceBrick>([this](const auto& b, core::Nanoseconds) {
        const auto brick = messages::from_idl(b);
        if (!brick || !assembler_.put_brick(brick->key, brick->version, brick->voxels_zstd))
          throw std::runtime_error("a brick that is none");
        bricks_[brick->key] = brick->version;
      })};
  dds::Reader<msg::WorkspaceVersion> version_reader_{
      participant_, dds::kWorkspaceVersion,
      under_lock<msg::WorkspaceVersion>(
          [this](const auto& v, core::Nanoseconds at_ns) { commit(v, at_ns); })};
  dds::Reader<msg::Percept> percept_reader_{
      participant_, dds::kPercept, under_lock<msg::Percept>([this](const auto& p, core::Nanoseconds at_ns) {
        percept_ = p;
        if (p.workspace_version() != 0 && !felt_.contains(p.workspace_version()))
          felt_[p.workspace_version()] = {at_ns, waited_s()};
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
