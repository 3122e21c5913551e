#pragma once

#include <atomic>
#include <mutex>
#include <vector>

#include "common/core/recent_map.hpp"
#include "common/dds/guid_prefix.hpp"

namespace phantom::dds {

/// Participants from which nothing is taken any more, because they sent more than is kept: readers name them,
/// the transport refuses what they send and has Fast DDS forget them. A process that starts anew is another
/// participant. Thread-safe.
class Bans {
 public:
  static constexpr std::size_t kMost = 1024;

  void ban(const GuidPrefix& participant) {
    const std::lock_guard lock(mutex_);
    if (!banned_.find_or_add(participant).second) return;
    fresh_.push_back(participant);
    any_.store(true, std::memory_order_release);
  }
  /// Cheap while nobody is banned.
  bool holds(const GuidPrefix& participant) const {
    if (!any_.load(std::memory_order_acquire)) return false;
    const std::lock_guard lock(mutex_);
    return banned_.contains(participant);
  }
  /// Returns those that were banned since the last call.
  std::vector<GuidPrefix> take_fresh() {
    if (!any_.load(std::memory_order_acquire)) return {};
    const std::lock_guard lock(mutex_);
    return std::exchange(fresh_, {});
  }
  /// Returns how many bans were forgotten for others.
  std::uint64_t forgotten() const {
    const std::lock_guard lock(mutex_);
    return banned_.dropped();
  }

 private:
  std::atomic<bool> any_{false};
  mutable std::mutex mutex_;
  core::RecentMap<GuidPrefix, bool> banned_{kMost};
  std::vector<GuidPrefix> fresh_;
};

}  // namespace phantom::dds
