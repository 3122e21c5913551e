#include "components/phantom_sensing/workspace_keeper.hpp"

#include <chrono>

namespace phantom::phantom_sensing {

WorkspaceKeeper::WorkspaceKeeper(std::function<void(const std::string&)> on_refused)
    : on_refused_(std::move(on_refused)), thread_([this] { work(); }) {}

WorkspaceKeeper::~WorkspaceKeeper() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void WorkspaceKeeper::enqueue(Job job) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  wake_.notify_one();
}

void WorkspaceKeeper::put_brick(voxel::BrickKey key, std::uint64_t version, std::vector<std::uint8_t> bytes) {
  enqueue(Brick{key, version, std::move(bytes)});
}
void WorkspaceKeeper::commit(voxel::VersionDescription description) { enqueue(std::move(description)); }

void WorkspaceKeeper::apply(const Job& job) {
  core::Status status;
  if (const auto* brick = std::get_if<Brick>(&job)) {
    status = assembler_.put_brick(brick->key, brick->version, brick->bytes);
  } else {
    status = assembler_.commit(std::get<voxel::VersionDescription>(job));
  }
  if (!status) on_refused_(status.message());
}

void WorkspaceKeeper::hand_over() {
  const auto& current = assembler_.current();
  if (!current || (!alive_.empty() && alive_.back().workspace == current)) return;
  const std::uint64_t generation = alive_.empty() ? 1 : alive_.back().generation + 1;
  {
    const std::lock_guard lock(alive_mutex_);
    alive_.push_back({current, generation});
  }
  handed_over_.write({{current.get(), assembler_.greatest_neighbour_mu()}, generation});
  version_.store(current->version, std::memory_order_relaxed);
}

void WorkspaceKeeper::let_go() {
  const std::uint64_t acknowledged = acknowledged_.load(std::memory_order_acquire);
  {
    const std::lock_guard lock(alive_mutex_);
    while (!alive_.empty() && alive_.front().generation < acknowledged) alive_.pop_front();
  }
  kept_.store(alive_.size(), std::memory_order_relaxed);
}

std::shared_ptr<const voxel::Workspace> WorkspaceKeeper::share() const {
  const std::lock_guard lock(alive_mutex_);
  return alive_.empty() ? nullptr : alive_.back().workspace;
}

void WorkspaceKeeper::work() {
  std::unique_lock lock(mutex_);
  while (!stop_) {
    // Wakes by itself now and then only while an old version waits to be let go.
    const auto something = [this] { return stop_ || !jobs_.empty(); };
    if (alive_.size() > 1) {
      wake_.wait_for(lock, std::chrono::milliseconds(100), something);
    } else {
      wake_.wait(lock, something);
    }
    std::deque<Job> jobs;
    jobs.swap(jobs_);
    lock.unlock();
    let_go();
    for (const Job& job : jobs) {
      apply(job);
      hand_over();
    }
    lock.lock();
    if (!stop_ && jobs_.empty() && alive_.size() < 2) {  // time to make the next version cheap
      lock.unlock();
      assembler_.prepare();
      lock.lock();
    }
  }
}

SensedWorkspace WorkspaceKeeper::newest() noexcept {
  handed_over_.read(in_use_);
  acknowledged_.store(in_use_.generation, std::memory_order_release);
  return in_use_.workspace;
}

}  // namespace phantom::phantom_sensing
