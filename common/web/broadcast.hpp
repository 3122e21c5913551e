#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>

namespace phantom::web {

/// Holds the newest value for several followers, each at its own pace. Slow followers skip values; the
/// publisher never waits for them. Thread-safe.
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

  /// Waits until there is a newer value than number `seen`, or `patience` has passed. Returns that value and
  /// sets `seen` to its number, or returns null if there is no newer one.
  Content next(std::uint64_t& seen, std::chrono::milliseconds patience) {
    std::unique_lock lock(mutex_);
    if (!changed_.wait_for(lock, patience, [&] { return number_ != seen && content_; })) return nullptr;
    seen = number_;
    return content_;
  }

  /// Returns the newest value; null: there is none.
  Content newest() const {
    const std::lock_guard lock(mutex_);
    return content_;
  }

  /// Returns a copy of the newest value; T() if there is none.
  T newest_or_default() const {
    const Content content = newest();
    return content ? *content : T();
  }

  /// Discards the content, so that a new follower does not get an old value.
  void clear() {
    const std::lock_guard lock(mutex_);
    content_.reset();
  }

  std::atomic<int> followers{0};  ///< counted by the followers; without any, no content need be made

 private:
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  Content content_;
  std::uint64_t number_ = 0;
};

}  // namespace phantom::web
