#pragma once

#include <vector>

#include "common/robot/serial_arm.hpp"
#include "common/robot/skin.hpp"
#include "common/runtime/cell_arms.hpp"

namespace phantom::runtime {

/// Kinematics of a cell's arm, from its URDF or DH table. Checks that `home` has one value for each joint,
/// within its limits, and that torque constants, if given, are as many. Throws ConfigError naming the arm's
/// file, the key and what is allowed, MissingError if a mesh or the URDF is not there.
robot::SerialArm load_arm(const ArmConfig& config);

/// The arm's skin with all ends placed and all meshes read, ready to be laid out. Throws as load_arm().
std::vector<robot::LinkSkin> load_skin(const ArmConfig& config, const robot::SerialArm& arm);

}  // namespace phantom::runtime
