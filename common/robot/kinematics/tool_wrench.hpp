#pragma once

#include "common/robot/kinematics/jacobian.hpp"

namespace phantom::robot {

/// Returns the wrench at the tool, in its axes (N, N·m), whose joint torques Jᵀ·w come nearest to `torque`,
/// by least squares; of those the smallest. Directions in which a singular pose gives the joints nothing to
/// feel have none, and what of the torques no wrench at the tool makes is left out: an arm that is felt at
/// its elbow.
Spatial wrench_at_tool(const SerialArm& arm, const core::JointArray& position,
                       const core::JointArray& torque);

/// Returns the force at the tool, in N, of the wrench there that comes near to `torque` by damped least
/// squares. The damping, a hundredth of the greatest gain, lowers it by 1 part in 10,000 at least, and by
/// half in directions that give the joints a hundredth as much to feel as the greatest. 0 if it is not
/// finite. Real-time safe: yes.
double tool_force_N(const SerialArm& arm, const LinkPoses& X_WL, const core::JointArray& torque) noexcept;

}  // namespace phantom::robot
