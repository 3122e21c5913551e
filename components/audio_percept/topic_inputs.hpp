#pragma once

#include <cstdint>
#include <set>

#include "common/core/clock.hpp"
#include "components/audio_percept/audio_percept.hpp"

namespace phantom::audio_percept {

/// Counts the alerts that have not been cleared; a restarted sender's earlier alerts count as cleared. Takes
/// alerts of one process at a time, in order. Bounded in memory.
class AlertCount {
 public:
  AlertSample take(const messages::Received<messages::HitAlert>& alert);

 private:
  std::uint64_t session_ = 0;
  std::set<std::uint32_t> active_;
  core::Nanoseconds raised_ns_ = 0;
};

/// Keeps in `sample` what an operator's command says about the sound; most commands say nothing of it.
void take(const messages::OperatorCommand& command, core::Nanoseconds received_ns, CommandSample& sample);

/// Returns the axes of the view that the operator looks at.
ViewSample view_of(const messages::Received<messages::ViewPose>& view);

/// view_pose comes at 10 Hz: its writer may be silent for so long.
inline constexpr core::Nanoseconds kViewHold_ns = core::kNsPerSecond;

}  // namespace phantom::audio_percept
