#pragma once

#include <vector>

#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::robot {

/// A point of a gripper's finger, in the frame of the link that carries the gripper.
struct FingerPoint {
  std::size_t link = 0;
  Eigen::Vector3d open_m;     ///< with the gripper at its widest
  Eigen::Vector3d closing_m;  ///< its way from there until the gripper is closed
};

/// Returns points all over the fingers of an arm's gripper, no farther apart than `pitch_m`: of the meshes
/// that stand elsewhere in `closed`, the same arm with its gripper closed, than in `open`. Errors: a mesh
/// that cannot be read, or that has no surface. Not real-time safe.
core::Expected<std::vector<FingerPoint>> finger_points(const SerialArm& open, const SerialArm& closed,
                                                       double pitch_m);

}  // namespace phantom::robot
