#pragma once

#include <span>
#include <vector>

#include "common/robot/kinematics/serial_arm.hpp"
#include "components/synthetic_viewer/state/state.hpp"

namespace phantom::synthetic_viewer {

/// Returns how freely the tool can be moved, 0…1: the least speed of its tip over the directions of space, as
/// a share of the greatest, at equal joint speeds (inverse condition number of the translational Jacobian,
/// Yoshikawa 1985). Prismatic joints count as revolute ones at 1 m. 1 for fewer than three joints. Pure.
double tool_freedom(const robot::SerialArm& arm, const core::JointArray& position);

/// What holds drag and feedback back, as the newest status of master_io tells; master_state alone does not
/// tell a guard of stability from a cap.
struct HeldBack {
  bool percept_guarded = false, percept_capped = false, feedback_capped = false;
  bool drag_masked = false;  ///< by the slave's feedback, most of the time
};
/// Pure. Of a master_io whose status has no such figures, a percept that is limited counts as guarded.
HeldBack held_back(const ViewerState& state, core::Nanoseconds now_ns);

/// Returns what limits the operator's hand now, each in one sentence, the most effective first: a stop, an
/// enabling switch, alignment, a lost link, a joint's end, a singular pose, the delay, the guards of
/// stability, a greatest torque, feedback that masks the drag, a missing sensor. Empty: nothing does, as far
/// as the states tell. `joints`: those of the arm; `freedom`: tool_freedom(). Pure.
std::vector<LocalizedText> hand_limits(const ViewerState& state, std::span<const robot::Joint> joints,
                                       double freedom, const Staleness& staleness, core::Nanoseconds now_ns);

}  // namespace phantom::synthetic_viewer
