#pragma once

#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "common/dds/admission/refusal_log.hpp"
#include "common/dds/endpoints/endpoint.hpp"
#include "common/workspace/workspace_sources.hpp"

namespace phantom::messages {

/// Follows workspace_brick and workspace_version, and puts their newest whole version together
/// (workspace::WorkspaceSources) on the thread of whoever asks for it: the middleware's threads only copy
/// what comes, so that no other topic waits while a workspace is built. What waits is bounded: if more comes
/// than may wait until somebody asks, all of it is dropped, and asked for anew by new readers.
class WorkspaceFollower {
 public:
  /// `most_bytes`: of a server's workspace; `most_waiting_bytes`: of samples that wait. Throws dds::DdsError.
  WorkspaceFollower(dds::Participant& participant, std::size_t most_bytes, std::size_t most_waiting_bytes);
  /// The same; samples that wait take a quarter of a workspace.
  WorkspaceFollower(dds::Participant& participant, std::size_t most_bytes)
      : WorkspaceFollower(participant, most_bytes, most_bytes / 4) {}

  /// Takes what has come, and returns the newest whole version; null before the first. Takes as long as
  /// building it does: seconds for a large cell's first. Thread-safe: others wait meanwhile.
  std::shared_ptr<const workspace::Workspace> take();

 private:
  using Job = std::function<core::Status(workspace::WorkspaceSources&)>;
  void open();
  bool enqueue(Job job, std::size_t bytes = 0);
  bool refuse(const core::Status& why);

  static constexpr std::size_t kJobBytes = 128;  // of a sample besides its content

  dds::Participant& participant_;
  const std::size_t most_bytes_, most_waiting_bytes_;
  std::mutex building_;                  // held while jobs are done; locked before mutex_
  workspace::WorkspaceSources sources_;  // guarded by building_
  std::mutex mutex_;
  std::deque<Job> jobs_;  // guarded by mutex_, as the two below
  std::size_t waiting_bytes_ = 0;
  bool overrun_ = false;
  dds::RefusalLog refusals_{"workspace_brick, workspace_version"};
  // Declared last, so that their callbacks end before the members that they use are destroyed.
  std::optional<dds::Reader<msg::WorkspaceBrick>> bricks_;
  std::optional<dds::Reader<msg::WorkspaceVersion>> versions_;
};

}  // namespace phantom::messages
