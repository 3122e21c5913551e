#pragma once

#include <span>
#include <vector>

#include "common/robot/kinematics/serial_arm.hpp"
#include "components/synthetic_viewer/state/state.hpp"

namespace phantom::synthetic_viewer {

/// Returns what limits the operator's hand now, each in one sentence, the most effective first: a stop, an
/// enabling switch, alignment, a lost link, a joint's end, the delay, the guards of stability, a missing
/// sensor. Empty: nothing does, as far as the states tell. `joints`: those of the arm. Pure.
std::vector<LocalizedText> hand_limits(const ViewerState& state, std::span<const robot::Joint> joints,
                                       const Staleness& staleness, core::Nanoseconds now_ns);

}  // namespace phantom::synthetic_viewer
