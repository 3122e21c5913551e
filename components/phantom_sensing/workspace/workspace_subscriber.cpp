#include "components/phantom_sensing/workspace/workspace_subscriber.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "common/core/thread_config.hpp"

namespace phantom::phantom_sensing {

WorkspaceSubscriber::WorkspaceSubscriber(Callbacks callbacks, std::size_t most_bytes, CarriedParts* parts)
    : callbacks_(std::move(callbacks)),
      most_waiting_bytes_(most_bytes / 4),
      parts_(parts),
      sources_(most_bytes),
      thread_([this] { work(); }) {}

WorkspaceSubscriber::~WorkspaceSubscriber() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

/// Reserves room for a sample, under the lock. Who finds none is in excess: DDS has given its sample away.
bool WorkspaceSubscriber::reserve_for(const workspace::SourceId& source, std::size_t bytes) {
  if (!attended_by_ || *attended_by_ == source) return true;
  if (waiting_of_others_ + bytes > kMaxOfOthers) {
    constexpr std::size_t kMax = 64;  // further ones are told of when they send again
    if (in_excess_.size() < kMax && std::ranges::find(in_excess_, source) == in_excess_.end())
      in_excess_.push_back(source);
    return false;
  }
  waiting_of_others_ += bytes;
  return true;
}

void WorkspaceSubscriber::enqueue(Job job, std::size_t bytes, const workspace::SourceId* source) {
  {
    const std::lock_guard lock(mutex_);
    bytes += kJobBytes;
    if (source != nullptr && !reserve_for(*source, bytes)) {
      wake_.notify_one();
      return;
    }
    if (jobs_.size() >= kMaxWaiting || waiting_bytes_ + bytes > most_waiting_bytes_) {
      ++lost_;
      return;
    }
    waiting_bytes_ += bytes;
    jobs_.push_back(std::move(job));
  }
  wake_.notify_one();
}

void WorkspaceSubscriber::put_brick(const workspace::SourceId& source, workspace::BrickKey key,
                                    std::uint64_t version, std::vector<std::uint8_t> bytes) {
  const std::size_t size = bytes.size();
  enqueue(
      [this, source, key, version, bytes = std::move(bytes)](workspace::WorkspaceSources& sources) {
        return checked(source, sources.put_brick(source, key, version, bytes));
      },
      size, &source);
}
void WorkspaceSubscriber::commit(const workspace::SourceId& source, workspace::VersionDescription description,
                                 Carried carried) {
  enqueue([this, source, description = std::move(description),
           carried = std::move(carried)](workspace::WorkspaceSources& sources) {
    core::Status taken = checked(source, sources.commit(source, description));
    if (!taken) return taken;
    note_committed({source, description.version, carried});
    return taken;
  });
}
void WorkspaceSubscriber::put_mesh(const workspace::SourceId& source, messages::MeshChunk chunk) {
  if (parts_ == nullptr) return;
  const std::size_t size = chunk.data.size();
  enqueue([this, chunk = std::move(chunk)](workspace::WorkspaceSources&) { return parts_->put(chunk); }, size,
          &source);
}
/// Tells the caller of a source in excess by the `status` of what it sent.
core::Status WorkspaceSubscriber::checked(const workspace::SourceId& source, core::Status status) const {
  if (status.code() == core::ErrorCode::kResourceExhausted && sources_.attended() &&
      sources_.in_force() != source)
    callbacks_.excess(source);
  return status;
}
void WorkspaceSubscriber::refuse(const core::Status& why) {
  enqueue([why](workspace::WorkspaceSources&) { return why; });
}
void WorkspaceSubscriber::gone(const workspace::SourceId& source) {
  enqueue([this, source](workspace::WorkspaceSources& sources) {
    const bool was_attended = sources.attended();
    sources.gone(source);
    if (was_attended && !sources.attended()) {
      // In this order: nothing more is dropped, whoever lost something is known, and all may send anew.
      note_attended();
      report_excess();
      callbacks_.unattended();
    }
    return core::Status::ok();
  });
}

/// Keeps what was carried in the newest versions of each source; of a source that is not in force, not for
/// ever.
void WorkspaceSubscriber::note_committed(Committed committed) {
  const workspace::SourceId source = committed.source;
  committed_.push_back(std::move(committed));
  const auto of_source = [&source](const Committed& other) { return other.source == source; };
  if (std::count_if(committed_.begin(), committed_.end(), of_source) > kCommittedOfSource)
    committed_.erase(std::find_if(committed_.begin(), committed_.end(), of_source));
  if (committed_.size() > kMaxCommitted)
    committed_.erase(std::find_if(committed_.begin(), committed_.end(), [this](const Committed& other) {
      return !sources_.in_force() || other.source != *sources_.in_force();
    }));
}

void WorkspaceSubscriber::hand_over() {
  announced_.store(sources_.announced(), std::memory_order_release);
  contested_.store(sources_.contested(), std::memory_order_relaxed);
  const auto& current = sources_.current();
  if (!current || (!alive_.empty() && alive_.back().workspace == current)) return;
  std::shared_ptr<CarryingSkin> skin;
  if (!make_skin(*sources_.in_force(), current->version, skin)) return;
  const std::uint64_t generation = alive_.empty() ? 1 : alive_.back().generation + 1;
  {
    const std::lock_guard lock(alive_mutex_);
    alive_.push_back({current, generation, *sources_.in_force(), skin});
  }
  SensedWorkspace sensed{current.get(), sources_.greatest_neighbour_mu()};
  if (skin) sensed.carrying = &skin->sensing, sensed.carried_key = skin->key, sensed.boxes = &skin->boxes;
  handed_over_.write({sensed, generation});
  version_.store(current->version, std::memory_order_relaxed);
}

/// Makes the skin that belongs to a version: the one in use, if the arm carries the same. Returns false while
/// it cannot be made; why is reported once.
bool WorkspaceSubscriber::make_skin(const workspace::SourceId& source, std::uint64_t version,
                                    std::shared_ptr<CarryingSkin>& skin) {
  if (parts_ == nullptr) return true;
  if (version == impossible_) return false;
  const auto of_version = std::find_if(
      committed_.rbegin(), committed_.rend(),
      [&](const Committed& committed) { return committed.source == source && committed.version == version; });
  if (of_version == committed_.rend()) return false;  // a newer one is on its way
  const auto made = parts_->skin_with(of_version->carried);
  if (made) {
    skin = *made;
    skin_problem_.clear();
    return true;
  }
  // A mesh may still come; all else stays as it is in this version.
  if (made.status().code() != core::ErrorCode::kUnavailable) impossible_ = version;
  if (const std::string before = std::exchange(skin_problem_, made.status().message());
      before != skin_problem_)
    callbacks_.refused(skin_problem_);
  return false;
}

std::vector<std::uint16_t> WorkspaceSubscriber::carried() const {
  const std::lock_guard lock(alive_mutex_);
  return alive_.empty() || !alive_.back().skin ? std::vector<std::uint16_t>() : alive_.back().skin->objects;
}

void WorkspaceSubscriber::note_attended() {
  const auto now = sources_.attended() ? sources_.in_force() : std::nullopt;
  const std::lock_guard lock(mutex_);
  attended_by_ = now;
}

void WorkspaceSubscriber::report_excess() {
  std::vector<workspace::SourceId> in_excess;
  {
    const std::lock_guard lock(mutex_);
    in_excess.swap(in_excess_);
  }
  for (const workspace::SourceId& source : in_excess) callbacks_.excess(source);
}

void WorkspaceSubscriber::let_go() {
  const std::uint64_t acknowledged = acknowledged_.load(std::memory_order_acquire);
  {
    const std::lock_guard lock(alive_mutex_);
    while (!alive_.empty() && alive_.front().generation < acknowledged) alive_.pop_front();
  }
  kept_.store(alive_.size(), std::memory_order_relaxed);
}

std::shared_ptr<const workspace::Workspace> WorkspaceSubscriber::share() const {
  const std::lock_guard lock(alive_mutex_);
  return alive_.empty() ? nullptr : alive_.back().workspace;
}

std::optional<workspace::SourceId> WorkspaceSubscriber::source() const {
  const std::lock_guard lock(alive_mutex_);
  return alive_.empty() ? std::nullopt : std::optional(alive_.back().source);
}

void WorkspaceSubscriber::work() {
  core::apply_thread_config(core::ThreadRole::kWorkspace);
  std::unique_lock lock(mutex_);
  while (!stop_) {
    // Polls only while an old version waits to be released.
    const auto something = [this] { return stop_ || !jobs_.empty() || !in_excess_.empty(); };
    progress_.rest();
    if (alive_.size() > 1) {
      wake_.wait_for(lock, std::chrono::milliseconds(100), something);
    } else {
      wake_.wait(lock, something);
    }
    progress_.tick();
    std::deque<Job> jobs;
    jobs.swap(jobs_);
    waiting_bytes_ = waiting_of_others_ = 0;
    const std::uint64_t lost = std::exchange(lost_, 0);
    lock.unlock();
    if (lost > 0)
      callbacks_.refused(std::to_string(lost) + " samples came while too many were waiting; allowed: " +
                         std::to_string(most_waiting_bytes_ >> 20) + " MiB");
    report_excess();
    for (const Job& job : jobs) {
      if (stop_) return;  // what is queued can take longer than the process may take to end
      let_go();           // before each: a version that only the keeper holds is changed in place
      if (const core::Status status = job(sources_); !status) callbacks_.refused(status.message());
      hand_over();
      progress_.tick();
    }
    let_go();
    note_attended();
    lock.lock();
    if (!stop_ && jobs_.empty() && alive_.size() < 2) {  // idle: prepare the buffer for the next version
      lock.unlock();
      sources_.prepare();
      lock.lock();
    }
  }
}

SensedWorkspace WorkspaceSubscriber::look() noexcept {
  handed_over_.read(in_use_);
  return in_use_.workspace;
}

}  // namespace phantom::phantom_sensing
