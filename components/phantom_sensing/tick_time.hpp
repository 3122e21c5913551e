#pragma once

#include <string>

#include "components/phantom_sensing/phantom_sensing.hpp"

namespace phantom::phantom_sensing {

/// Time between two slave_states (topic table), in which a tick must be done.
inline constexpr double kStatePeriod_s = 0.001;

/// What a tick costs on this host, as it was measured.
struct TickTime {
  double free_s = 0.0;  ///< median in free space, where it costs least
  double full_s =
      0.0;  ///< median where it costs most: every sensor in fluid, of another μ than its neighbour's
  double full_p99_s = 0.0;  ///< the same, 99 of 100
};

/// What the tick is to be timed in.
struct TickCase {
  core::JointArray home{};          ///< rad or m; the arm is moved a little about it
  workspace::GridSpec grid;         ///< of the cell
  std::vector<float> palette;       ///< likewise
  percept::AllowedContact allowed;  ///< links that may touch something leave the fast loop
};

/// Runs the step itself, with its settings and threads, for about `duration_s` in a workspace made up for
/// that: in free space and in fluid that costs most. Sensors and their content decide on a tick's cost, so
/// this bounds it for the configuration, as far as the host is left alone. Not real-time safe.
TickTime time_tick(const PhantomModel& model, const PerceptSettings& settings, const TickCase& at,
                   double duration_s);

/// In one sentence, against kStatePeriod_s.
std::string words_for(const TickTime& time);

}  // namespace phantom::phantom_sensing
