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
#include <vector>

#include "common/core/progress.hpp"
#include "common/core/snapshot.hpp"
#include "common/workspace/workspace_sources.hpp"
#include "components/phantom_sensing/carried_parts.hpp"
#include "components/phantom_sensing/phantom_sensing.hpp"

namespace phantom::phantom_sensing {

/// Assembles the workspace from bricks on its own thread and hands complete versions to the sensing thread
/// without a lock. The sensing thread gets a bare pointer; the keeper keeps that version alive until the
/// sensing thread has moved on. It stays with one server for as long as that is present
/// (workspace::WorkspaceSources). It holds two buffers of a workspace, so that a version that changes some
/// bricks costs only those: it is handed over within milliseconds of its last brick.
///
/// A version is handed over together with the skin that belongs to it: the arm's with what the arm carries
/// then. While that skin cannot be made, for want of a mesh, the version before stays in use.
///
/// While that server is present, whoever else sends more than is kept beside it, or faster than it is looked
/// at (kMaxOfOthers), is a source in excess: the caller is to take no more from it, so that what DDS keeps
/// of it does not grow, until the server has gone.
class WorkspaceSubscriber {
 public:
  /// Called on the keeper's thread.
  struct Callbacks {
    /// For each unusable sample, with the reason, and once for all samples for which there was no room.
    std::function<void(const std::string&)> refused;
    /// For a source in excess.
    std::function<void(const workspace::SourceId&)> excess = [](const auto&) {};
    /// When the server in use has gone: sources in excess may send again.
    std::function<void()> unattended = [] {};
  };
  using Carried = std::vector<messages::CarriedObject>;
  /// What waits of others than the server in use while that is present, in bytes.
  static constexpr std::size_t kMaxOfOthers = std::size_t{4} << 20;

  /// `most_bytes`: of a server's workspace; samples that wait take a quarter of that.
  /// `parts`: makes the skins of what the arm carries, on the keeper's thread; null: nothing is ever carried.
  /// It must outlive this.
  explicit WorkspaceSubscriber(Callbacks callbacks, std::size_t most_bytes = SIZE_MAX,
                               CarriedParts* parts = nullptr);
  ~WorkspaceSubscriber();

  // Called on middleware threads; they queue and return.
  void put_brick(const workspace::SourceId& source, workspace::BrickKey key, std::uint64_t version,
                 std::vector<std::uint8_t> bytes);
  void commit(const workspace::SourceId& source, workspace::VersionDescription description,
              Carried carried = {});
  void put_mesh(const workspace::SourceId& source, messages::MeshChunk chunk);
  /// Takes a sample that its codec refused, with the reason.
  void refuse(const core::Status& why);
  /// Reports that a participant has ended or is no longer heard.
  void gone(const workspace::SourceId& source);

  /// Returns the newest complete version, valid until the next call; none before the first. One thread only.
  /// Real-time safe: yes.
  SensedWorkspace newest() noexcept {
    const SensedWorkspace workspace = look();
    release_older();
    return workspace;
  }
  /// Likewise; but what the call before returned is valid until release_older(), too.
  SensedWorkspace look() noexcept;
  void release_older() noexcept { acknowledged_.store(in_use_.generation, std::memory_order_release); }

  /// Returns the version that was handed over last, to be read outside the sensing thread; null: none. While
  /// it is held, the version after the next one costs more. Thread-safe; not real-time safe.
  std::shared_ptr<const workspace::Workspace> share() const;
  /// Returns the number of the version that was handed over last; 0: none. Thread-safe.
  std::uint64_t version() const noexcept { return version_.load(std::memory_order_relaxed); }
  /// Returns the ids of the objects that the arm carries in that version. Thread-safe.
  std::vector<std::uint16_t> carried() const;
  /// Returns the thread's progress. Thread-safe.
  const core::Progress& progress() const noexcept { return progress_; }
  /// Returns the newest valid version announced by the server in use; 0: none. Thread-safe. Real-time safe:
  /// yes.
  std::uint64_t announced() const noexcept { return announced_.load(std::memory_order_acquire); }
  /// Returns whether a second server sends a workspace, which is ignored. Thread-safe.
  bool contested() const noexcept { return contested_.load(std::memory_order_relaxed); }
  /// Returns the server whose workspace was handed over last; none before the first. Thread-safe.
  std::optional<workspace::SourceId> source() const;
  /// Returns the number of versions kept alive: 1, or 2 while the sensing thread still uses the previous one.
  /// Thread-safe.
  std::size_t versions_kept() const noexcept { return kept_.load(std::memory_order_relaxed); }

 private:
  using Job = std::function<core::Status(workspace::WorkspaceSources&)>;
  struct HandOver {
    SensedWorkspace workspace;
    std::uint64_t generation = 0;
  };
  struct Kept {
    std::shared_ptr<const workspace::Workspace> workspace;
    std::uint64_t generation;
    workspace::SourceId source;
    std::shared_ptr<CarryingSkin> skin;
  };
  /// What was carried in a version that was committed lately.
  struct Committed {
    workspace::SourceId source;
    std::uint64_t version;
    Carried carried;
  };
  static constexpr std::ptrdiff_t kCommittedOfSource = 2;
  static constexpr std::size_t kMaxCommitted = 16;
  static constexpr double kHangsAfter_s = 10.0;  // checking a version of a large cell takes seconds
  void enqueue(Job job, std::size_t bytes = 0, const workspace::SourceId* source = nullptr);
  bool reserve_for(const workspace::SourceId& source, std::size_t bytes);
  core::Status checked(const workspace::SourceId& source, core::Status status) const;
  void work();
  void note_committed(Committed committed);
  void hand_over();
  bool make_skin(const workspace::SourceId& source, std::uint64_t version,
                 std::shared_ptr<CarryingSkin>& skin);
  void note_attended();
  void report_excess();
  void let_go();

  static constexpr std::size_t kMaxWaiting = 2 * workspace::kMaxBricksInAll;
  static constexpr std::size_t kJobBytes = 128;  // of a sample besides its content

  const Callbacks callbacks_;
  const std::size_t most_waiting_bytes_;
  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Job> jobs_;
  std::size_t waiting_bytes_ = 0, waiting_of_others_ = 0;
  std::uint64_t lost_ = 0;                          // samples that found no room since the thread last looked
  std::vector<workspace::SourceId> in_excess_;      // likewise: others than the server in use
  std::optional<workspace::SourceId> attended_by_;  // the server in use, while it is present
  std::atomic<bool> stop_{false};                   // set under the lock

  // Used on the keeper's thread only.
  CarriedParts* const parts_;
  workspace::WorkspaceSources sources_;
  std::deque<Committed> committed_;  // the newest last
  std::string skin_problem_;         // reported last
  std::uint64_t impossible_ = 0;     // the version whose skin cannot be made
  std::deque<Kept> alive_;           // changed under alive_mutex_
  mutable std::mutex alive_mutex_;

  core::Snapshot<HandOver> handed_over_;
  HandOver in_use_;  // used on the sensing thread only
  std::atomic<std::uint64_t> acknowledged_{0};
  std::atomic<std::uint64_t> version_{0}, announced_{0};
  std::atomic<bool> contested_{false};
  std::atomic<std::size_t> kept_{0};
  core::Progress progress_{"workspace", 0.0, kHangsAfter_s};
  std::thread thread_;
};

}  // namespace phantom::phantom_sensing
