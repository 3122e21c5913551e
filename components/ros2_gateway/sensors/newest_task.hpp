#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <thread>

namespace phantom::ros2_gateway {

/// Carries out the newest task that it was given, on a thread of its own: what comes while one is under way
/// replaces what waits. So a message that takes long to decode does not make other topics wait.
class NewestTask {
 public:
  NewestTask() : thread_([this] { work(); }) {}
  /// Waits for the task that is under way; one that waits is dropped.
  ~NewestTask() {
    {
      const std::lock_guard lock(mutex_);
      ends_ = true;
    }
    changed_.notify_one();
    thread_.join();
  }
  NewestTask(const NewestTask&) = delete;
  NewestTask& operator=(const NewestTask&) = delete;

  /// Any thread.
  void put(std::function<void()> task) {
    {
      const std::lock_guard lock(mutex_);
      task_ = std::move(task);
    }
    changed_.notify_one();
  }

 private:
  void work() {
    for (;;) {
      std::optional<std::function<void()>> task;
      {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [this] { return ends_ || task_; });
        if (ends_) return;
        task.swap(task_);
      }
      (*task)();
    }
  }

  std::mutex mutex_;
  std::condition_variable changed_;
  bool ends_ = false;
  std::optional<std::function<void()>> task_;
  std::thread thread_;  // last: it uses what stands above
};

}  // namespace phantom::ros2_gateway
