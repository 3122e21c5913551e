#pragma once

#include "common/robot/kinematics/jacobian.hpp"

namespace phantom::robot {

/// Returns the wrench at the tool, in its axes (N, N·m), whose joint torques Jᵀ·w come nearest to `torque`,
/// by least squares; of those the smallest. Directions in which a singular pose gives the joints nothing to
/// feel have none, and what of the torques no wrench at the tool makes is left out: an arm that is felt at
/// its elbow.
Spatial wrench_at_tool(const SerialArm& arm, const core::JointArray& position,
                       const core::JointArray& torque);

}  // namespace phantom::robot
