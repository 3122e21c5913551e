#pragma once

#include <atomic>

#include "common/core/clock.hpp"
#include "common/dds/endpoints/stamp.hpp"

namespace phantom::dds {

/// The process that a reader of a periodic topic follows, for readers of what the same process sends on
/// events: between two events nothing shows whether that process still runs. One thread writes, others read.
/// Real-time safe: yes.
class FollowedSource {
 public:
  /// The followed process counts as present for this long after its last periodic sample.
  static constexpr core::Nanoseconds kThere_ns = core::kNsPerSecond / 2;

  FollowedSource() = default;
  /// A copy goes on by itself. The one that is copied must not be in use meanwhile.
  FollowedSource(const FollowedSource& other) noexcept { *this = other; }
  FollowedSource& operator=(const FollowedSource& other) noexcept {
    session_ = other.session_.load();
    heard_ns_ = other.heard_ns_.load();
    return *this;
  }
  ~FollowedSource() = default;

  /// Records a sample of the process that the periodic topic's reader follows.
  void heard(const msg::Stamp& stamp, core::Nanoseconds received_ns) noexcept {
    session_.store(stamp.session(), std::memory_order_relaxed);
    heard_ns_.store(received_ns, std::memory_order_release);
  }
  /// Returns whether `stamp` comes from another process while the followed one is present.
  bool is_rival(const msg::Stamp& stamp, core::Nanoseconds received_ns) const noexcept {
    const core::Nanoseconds heard_ns = heard_ns_.load(std::memory_order_acquire);
    return heard_ns != 0 && received_ns - heard_ns < kThere_ns &&
           session_.load(std::memory_order_relaxed) != stamp.session();
  }

 private:
  std::atomic<std::uint64_t> session_{0};
  std::atomic<core::Nanoseconds> heard_ns_{0};
};

}  // namespace phantom::dds
