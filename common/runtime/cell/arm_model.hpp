#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/robot/kinematics/serial_arm.hpp"
#include "common/robot/skin/finger_points.hpp"
#include "common/robot/skin/skin.hpp"
#include "common/runtime/cell/cell_arms.hpp"

namespace phantom::runtime {

/// Loads the kinematics of a cell's arm from its URDF or DH table. Checks that `home` has one value within
/// the limits for each joint. Throws ConfigError naming the arm's file, the key and what is allowed; throws
/// MissingError if a mesh or the URDF is missing.
robot::SerialArm load_kinematics(const ArmConfig& config);
/// Loads it for the component that uses it: logs its notices, too.
robot::SerialArm load_arm(const ArmConfig& config);
/// Loads it with its gripper closed; its links and meshes are in the same order. Throws as load_arm().
robot::SerialArm load_arm_with_closed_gripper(ArmConfig config);

/// Loads it so if its gripper moves.
std::optional<robot::SerialArm> load_closed_arm(const ArmConfig& config);
/// Returns points all over the fingers of its gripper, no farther apart than `pitch_m`; none for an arm
/// without a gripper that moves. Throws as load_arm().
std::vector<robot::FingerPoint> load_fingers(const ArmConfig& config, const robot::SerialArm& arm,
                                             double pitch_m);
/// Returns the way of the frame `frame` in the axes of its moving link as the gripper closes; zero without
/// `closed`.
Eigen::Vector3d closing_of_frame(const robot::SerialArm& arm, const std::optional<robot::SerialArm>& closed,
                                 const std::string& frame);

/// Loads the arm's skin: places the ends of all segments and axes and reads all meshes, ready for
/// lay_out_skin(). Throws as load_arm().
std::vector<robot::LinkSkin> load_skin(const ArmConfig& config, const robot::SerialArm& arm);

}  // namespace phantom::runtime
