#include "common/messages/workspace_follower.hpp"

#include <utility>
#include <vector>

#include "common/messages/codecs/workspace_codec.hpp"

namespace phantom::messages {

WorkspaceFollower::WorkspaceFollower(dds::Participant& participant, std::size_t most_bytes,
                                     std::size_t most_waiting_bytes)
    : participant_(participant),
      most_bytes_(most_bytes),
      most_waiting_bytes_(most_waiting_bytes),
      sources_(most_bytes) {
  open();
}

void WorkspaceFollower::open() {
  bricks_.emplace(participant_, dds::kWorkspaceBrick,
                  [this](const msg::WorkspaceBrick& message, const dds::SampleInfo& info) {
                    const auto brick = from_idl(message);
                    if (!brick) return refuse(brick.status());
                    std::vector<std::uint8_t> voxels(brick->voxels_zstd.begin(), brick->voxels_zstd.end());
                    const std::size_t bytes = voxels.size();
                    return enqueue(
                        [source = info.writer, key = brick->key, version = brick->version,
                         voxels = std::move(voxels)](workspace::WorkspaceSources& sources) {
                          return sources.put_brick(source, key, version, voxels);
                        },
                        bytes);
                  });
  versions_.emplace(
      participant_, dds::kWorkspaceVersion,
      [this](const msg::WorkspaceVersion& message, const dds::SampleInfo& info) {
        const auto version = from_idl(message);
        if (!version) return refuse(version.status());
        return enqueue(
            [source = info.writer, description = version->description](workspace::WorkspaceSources& sources) {
              return sources.commit(source, description);
            });
      },
      [this](const dds::GuidPrefix& server) {
        enqueue([server](workspace::WorkspaceSources& sources) {
          sources.gone(server);
          return core::Status::ok();
        });
      });
}

std::shared_ptr<const workspace::Workspace> WorkspaceFollower::take() {
  const std::lock_guard building(building_);
  std::deque<Job> jobs;
  bool overrun = false;
  {
    const std::lock_guard lock(mutex_);
    jobs.swap(jobs_);
    waiting_bytes_ = 0;
    overrun = std::exchange(overrun_, false);
  }
  if (overrun) {
    refuse({core::ErrorCode::kResourceExhausted, "queue overflow; requesting it again"});
    bricks_.reset();
    versions_.reset();
    sources_ = workspace::WorkspaceSources(most_bytes_);
    open();
  }
  for (const Job& job : jobs) refuse(job(sources_));
  return sources_.current();
}

bool WorkspaceFollower::enqueue(Job job, std::size_t bytes) {
  const std::lock_guard lock(mutex_);
  waiting_bytes_ += bytes + kJobBytes;
  overrun_ = overrun_ || waiting_bytes_ > most_waiting_bytes_;
  if (overrun_)
    jobs_.clear();
  else
    jobs_.push_back(std::move(job));
  return !overrun_;
}

/// Returns whether nothing is to be refused; logs why else.
bool WorkspaceFollower::refuse(const core::Status& why) {
  if (!why) refusals_.refused(why.message());
  return static_cast<bool>(why);
}

}  // namespace phantom::messages
