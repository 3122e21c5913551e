#pragma once

#include <string>

#include "components/phantom_sensing/phantom_sensing.hpp"

namespace phantom::phantom_sensing {

/// Time between two slave_states (topic table): the limit for a tick.
inline constexpr double kStatePeriod_s = 0.001;

/// Measured cost of a tick on this host.
struct TickTime {
  double free_s = 0.0;  ///< median in free space, where it costs least
  /// Median where a tick costs most: every sensor in fluid, its μ different from its neighbour's.
  double full_s = 0.0;
  double full_p99_s = 0.0;  ///< 99th percentile of the same
};

/// The conditions in which the tick is timed.
struct TickCase {
  core::JointArray home{};          ///< rad or m; the arm moves a little around it
  workspace::GridSpec grid;         ///< the cell's grid
  std::vector<float> palette;       ///< the cell's palette of μ
  percept::AllowedContact allowed;  ///< links with allowed contacts leave the fast loop
};

/// Times the real step, with its settings and threads, for about `duration_s` in two artificial workspaces:
/// free space and the fluid that costs most. Sensors and the voxels they are in determine a tick's cost, so
/// this bounds it for the configuration, provided that the host has no other load. Not real-time safe.
TickTime time_tick(const PhantomModel& model, const PerceptSettings& settings, const TickCase& at,
                   double duration_s);

/// Returns the timing in one sentence, compared with kStatePeriod_s.
std::string describe(const TickTime& time);

}  // namespace phantom::phantom_sensing
