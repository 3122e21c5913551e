#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <vector>

#include "common/core/recent_map.hpp"
#include "common/dds/admission/guid_prefix.hpp"

namespace phantom::dds {

/// Participants from which nothing is taken any more, because they sent more than is kept: the transport
/// refuses what they send and has Fast DDS forget them. A process that starts anew is another participant.
/// Thread-safe.
class Bans {
 public:
  static constexpr std::size_t kMax = 1024;

  /// For good.
  void ban(const GuidPrefix& participant) { add(banned_, participant); }
  /// Ends with resume().
  void suspend(const GuidPrefix& participant) { add(banned_for_now_, participant); }
  /// Ends all bans by ban_for_now(); returns whether there were any. Fast DDS discovers those participants
  /// again by their next announcement.
  bool resume() {
    const std::lock_guard lock(mutex_);
    const bool any = banned_for_now_.size() > 0;
    forgotten_before_ += banned_for_now_.dropped();
    banned_for_now_ = Banned{kMax};
    return any;
  }
  /// Cheap while nobody is banned.
  bool holds(const GuidPrefix& participant) const {
    if (!any_.load(std::memory_order_acquire)) return false;
    const std::lock_guard lock(mutex_);
    return banned_.contains(participant) || banned_for_now_.contains(participant);
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
    return forgotten_before_ + banned_.dropped() + banned_for_now_.dropped();
  }

 private:
  using Banned = core::RecentMap<GuidPrefix, bool>;
  void add(Banned& to, const GuidPrefix& participant) {
    const std::lock_guard lock(mutex_);
    if (!to.find_or_add(participant).second) return;
    fresh_.push_back(participant);
    any_.store(true, std::memory_order_release);
  }

  std::atomic<bool> any_{false};
  mutable std::mutex mutex_;
  Banned banned_{kMax}, banned_for_now_{kMax};
  std::uint64_t forgotten_before_ = 0;  // of bans that were lifted since
  std::vector<GuidPrefix> fresh_;
};

}  // namespace phantom::dds
