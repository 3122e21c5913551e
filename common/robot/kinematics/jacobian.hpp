#pragma once

#include <Eigen/Core>

#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::robot {

/// Linear over angular part: a twist (m/s, rad/s) or a wrench (N, N·m) at a point.
using Spatial = Eigen::Matrix<double, 6, 1>;

/// Twist of a point per unit of each joint's velocity; columns of joints that do not move it are zero.
using Jacobian = Eigen::Matrix<double, 6, static_cast<int>(core::kMaxJoints)>;

/// Pose of the tool in W: its origin is the end of the last link (the tip frame's origin), its axes are those
/// of the last moving link. Real-time safe: yes.
geometry::Pose tool_pose(const SerialArm& arm, const LinkPoses& X_WL) noexcept;

/// Returns the geometric Jacobian of the tool in W. Real-time safe: yes.
Jacobian tool_jacobian(const SerialArm& arm, const LinkPoses& X_WL) noexcept;

/// Returns the same of a point that is fixed to a link, 0 (the base) to the arm's joint count. Real-time
/// safe: yes.
Jacobian point_jacobian(const SerialArm& arm, const LinkPoses& X_WL, std::size_t link,
                        const Eigen::Vector3d& point_W_m) noexcept;

}  // namespace phantom::robot
