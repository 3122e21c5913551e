#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "common/core/progress.hpp"
#include "common/core/snapshot.hpp"
#include "common/workspace/workspace_sources.hpp"
#include "components/phantom_sensing/phantom_sensing.hpp"

namespace phantom::phantom_sensing {

/// Assembles the workspace from bricks on a thread of its own and hands whole versions to the sensing thread
/// without a lock: the sensing thread gets a bare pointer, this keeps the version alive until the sensing
/// thread has moved on. Keeps to one server for as long as that is there (workspace::WorkspaceSources). Holds
/// two buffers of a workspace, so that a version that changes some bricks costs those only: it is handed over
/// within milliseconds of its last brick.
class WorkspaceKeeper {
 public:
  /// `on_refused` is called on the keeper's thread for each sample that cannot be used, with what is wrong
  /// with it.
  explicit WorkspaceKeeper(std::function<void(const std::string&)> on_refused);
  ~WorkspaceKeeper();
  WorkspaceKeeper(const WorkspaceKeeper&) = delete;
  WorkspaceKeeper& operator=(const WorkspaceKeeper&) = delete;

  // From middleware threads: queue and return.
  void put_brick(const workspace::SourceId& source, workspace::BrickKey key, std::uint64_t version,
                 std::vector<std::uint8_t> bytes);
  void commit(const workspace::SourceId& source, workspace::VersionDescription description);
  /// A server has ended, or is not heard of any more.
  void gone(const workspace::SourceId& source);

  /// The newest whole version, valid until the next call; none before the first. One thread only. Real-time
  /// safe: yes.
  SensedWorkspace newest() noexcept;

  /// The version that was handed over last, for a look at leisure; null: none. The next version but one costs
  /// more while it is held. Thread-safe; not real-time safe.
  std::shared_ptr<const workspace::Workspace> share() const;
  /// Version that was handed over last; 0: none. Thread-safe.
  std::uint64_t version() const noexcept { return version_.load(std::memory_order_relaxed); }
  /// How the thread gets on. Thread-safe.
  const core::Progress& progress() const noexcept { return progress_; }
  /// The newest version that was announced by who counts, and found sound; 0: none. Thread-safe. Real-time
  /// safe: yes.
  std::uint64_t announced() const noexcept { return announced_.load(std::memory_order_acquire); }
  /// Whether a second server sends a workspace, which is set aside. Thread-safe.
  bool contested() const noexcept { return contested_.load(std::memory_order_relaxed); }
  /// The server whose workspace was handed over last; none before the first. Thread-safe.
  std::optional<workspace::SourceId> source() const;
  /// Versions kept alive: 1, or 2 while the sensing thread still uses the one before. Thread-safe.
  std::size_t versions_kept() const noexcept { return kept_.load(std::memory_order_relaxed); }

 private:
  struct Brick {
    workspace::SourceId source;
    workspace::BrickKey key;
    std::uint64_t version;
    std::vector<std::uint8_t> bytes;
  };
  struct Version {
    workspace::SourceId source;
    workspace::VersionDescription description;
  };
  struct Gone {
    workspace::SourceId source;
  };
  using Job = std::variant<Brick, Version, Gone>;
  struct HandOver {
    SensedWorkspace workspace;
    std::uint64_t generation = 0;
  };
  struct Kept {
    std::shared_ptr<const workspace::Workspace> workspace;
    std::uint64_t generation;
    workspace::SourceId source;
  };
  static constexpr double kHangsAfter_s = 10.0;  // a version of a large cell is checked in seconds
  void enqueue(Job job);
  void work();
  core::Status apply(const Brick& brick);
  core::Status apply(const Version& version);
  core::Status apply(const Gone& gone);
  void hand_over();
  void let_go();

  std::function<void(const std::string&)> on_refused_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Job> jobs_;
  bool stop_ = false;

  // Keeper's thread only.
  workspace::WorkspaceSources sources_;
  std::deque<Kept> alive_;  // changed under alive_mutex_
  mutable std::mutex alive_mutex_;

  core::Snapshot<HandOver> handed_over_;
  HandOver in_use_;  // sensing thread only
  std::atomic<std::uint64_t> acknowledged_{0};
  std::atomic<std::uint64_t> version_{0}, announced_{0};
  std::atomic<bool> contested_{false};
  std::atomic<std::size_t> kept_{0};
  core::Progress progress_{"workspace", 0.0, kHangsAfter_s};
  std::thread thread_;
};

}  // namespace phantom::phantom_sensing
