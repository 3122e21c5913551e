#pragma once

#include <atomic>
#include <cstdint>

#include "common/core/clock.hpp"
#include "common/messages/percept.hpp"

namespace phantom::phantom_sensing {

using messages::PerceptCondition;

constexpr bool is_valid(PerceptCondition condition) noexcept {
  return condition <= PerceptCondition::kWorkspaceBehind || condition == PerceptCondition::kModelInDoubt ||
         condition == PerceptCondition::kSpaceUnseen;
}

/// Decides whether the workspace in use is current. It stays valid while no newer one is announced, also when
/// its server ends: it is then marked as unattended. Once a version is announced, that version or another
/// step towards it must come into use within `behind_after_s`, or the percept is marked; after
/// `stale_after_s` the percept ends.
class WorkspaceWatch {
 public:
  WorkspaceWatch(double behind_after_s, double stale_after_s)
      : behind_after_ns_(core::from_seconds(behind_after_s)),
        stale_after_ns_(core::from_seconds(stale_after_s)) {}

  /// Sets the newest announced version; 0: none. Call it on the thread of assess(). Real-time safe: yes.
  void announced(std::uint64_t version) noexcept { announced_ = version; }
  /// Sets whether a server is present. Thread-safe.
  void attended(bool there) noexcept { attended_.store(there, std::memory_order_relaxed); }

  /// Returns the condition of the workspace. `in_use`: version that the tick uses, 0: none. One thread.
  /// Real-time safe: yes.
  PerceptCondition assess(std::uint64_t in_use, core::Nanoseconds now_ns) noexcept {
    if (in_use == 0) return PerceptCondition::kNoWorkspace;
    if (announced_ == 0 || announced_ == in_use || in_use != last_in_use_) behind_since_ns_ = -1;
    last_in_use_ = in_use;
    if (announced_ != 0 && announced_ != in_use) {
      if (behind_since_ns_ < 0) behind_since_ns_ = now_ns;
      const core::Nanoseconds behind_ns = now_ns - behind_since_ns_;
      if (behind_ns > stale_after_ns_) return PerceptCondition::kWorkspaceStale;
      if (behind_ns > behind_after_ns_) return PerceptCondition::kWorkspaceBehind;
    }
    return attended_.load(std::memory_order_relaxed) ? PerceptCondition::kFresh
                                                     : PerceptCondition::kWorkspaceUnattended;
  }

 private:
  core::Nanoseconds behind_after_ns_, stale_after_ns_;
  std::atomic<bool> attended_{true};
  std::uint64_t announced_ = 0, last_in_use_ = 0;
  core::Nanoseconds behind_since_ns_ = -1;  // −1: not behind
};

}  // namespace phantom::phantom_sensing
