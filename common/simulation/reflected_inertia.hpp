#pragma once

#include "common/core/joints.hpp"
#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::simulation {

/// Returns the reflected inertia of each joint, kg·m² or kg: the diagonal of the mass matrix at pose `q`,
/// with links as point masses at their centres of mass, plus the `rotor` inertia seen at the joint. Real-time
/// safe: yes.
core::JointArray reflected_inertia(const robot::SerialArm& arm, const core::JointArray& q,
                                   const core::JointArray& rotor) noexcept;

}  // namespace phantom::simulation
