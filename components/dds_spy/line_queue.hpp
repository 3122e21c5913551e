#pragma once

#include <cstdint>
#include <deque>
#include <mutex>
#include <string>
#include <utility>

namespace phantom::dds_spy {

/// Passes text from middleware threads to the printing thread, so that a slow terminal or pipe delays none of
/// them. Bounded in number and octets; texts for which there is no room are dropped and counted. Thread-safe.
class LineQueue {
 public:
  explicit LineQueue(std::size_t most, std::size_t most_octets) : most_(most), most_octets_(most_octets) {}

  void put(std::string text) {
    const std::lock_guard lock(mutex_);
    if (texts_.size() < most_ && text.size() <= most_octets_ - octets_) {
      octets_ += text.size();
      texts_.push_back(std::move(text));
    } else {
      ++dropped_;
    }
  }
  /// Removes and returns all waiting texts, in order.
  std::deque<std::string> take() {
    const std::lock_guard lock(mutex_);
    octets_ = 0;
    return std::exchange(texts_, {});
  }
  std::uint64_t dropped() const {
    const std::lock_guard lock(mutex_);
    return dropped_;
  }

 private:
  const std::size_t most_, most_octets_;
  mutable std::mutex mutex_;
  std::deque<std::string> texts_;
  std::size_t octets_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace phantom::dds_spy
