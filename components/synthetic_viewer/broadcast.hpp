#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>

namespace phantom::synthetic_viewer {

/// The newest of something that many follow, each at its own pace: slow followers skip, nobody waits for
/// them. Thread-safe.
template <class T>
class Broadcast {
 public:
  using Content = std::shared_ptr<const T>;

  void publish(T content) { publish(std::make_shared<const T>(std::move(content))); }
  void publish(Content next) {
    {
      const std::lock_guard lock(mutex_);
      content_ = std::move(next);
      ++number_;
    }
    changed_.notify_all();
  }

  /// Waits until there is something newer than `seen` or the time is up; then `seen` is its number. Null:
  /// nothing newer.
  Content next(std::uint64_t& seen, std::chrono::milliseconds patience) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, patience, [&] { return number_ != seen && content_; })) return nullptr;
    seen = number_;
    return content_;
  }

  /// The newest, now; null: there is none.
  Content newest() const {
    const std::lock_guard lock(mutex_);
    return content_;
  }

  /// Forgets the content: who comes next shall not see what is old.
  void clear() {
    const std::lock_guard lock(mutex_);
    content_.reset();
  }

  std::atomic<int> followers{0};  ///< kept by those who follow: without any, content need not be made

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Content content_;
  std::uint64_t number_ = 0;
};

}  // namespace phantom::synthetic_viewer
