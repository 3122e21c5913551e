#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <utility>

namespace phantom::dds_spy {

/// Text on its way from middleware threads to the thread that prints: a slow terminal or pipe holds nobody
/// up. Bounded; what finds no room is counted. Thread-safe.
class LineQueue {
 public:
  explicit LineQueue(std::size_t most) : most_(most) {}

  void put(std::string text) {
    const std::lock_guard lock(mutex_);
    if (texts_.size() < most_) {
      texts_.push_back(std::move(text));
    } else {
      ++dropped_;
    }
  }
  /// All that waits, in order.
  std::deque<std::string> take() {
    const std::lock_guard lock(mutex_);
    return std::exchange(texts_, {});
  }
  std::uint64_t dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  const std::size_t most_;
  mutable std::mutex mutex_;
  std::deque<std::string> texts_;
  std::uint64_t dropped_ = 0;
};

}  // namespace phantom::dds_spy
