#include "common/robot/kinematics/jacobian.hpp"

#include <Eigen/Geometry>

namespace phantom::robot {

geometry::Pose tool_pose(const SerialArm& arm, const LinkPoses& X_WL) noexcept {
  const std::size_t last = arm.joint_count();
  return {X_WL[last].rotation, X_WL[last] * arm.link_axis_m(last).second};
}

Jacobian tool_jacobian(const SerialArm& arm, const LinkPoses& X_WL) noexcept {
  return point_jacobian(arm, X_WL, arm.joint_count(), tool_pose(arm, X_WL).translation_m);
}

Jacobian point_jacobian(const SerialArm& arm, const LinkPoses& X_WL, std::size_t link,
                        const Eigen::Vector3d& point_W_m) noexcept {
  Jacobian jacobian = Jacobian::Zero();
  for (std::size_t j = 0; j < link; ++j) {
    const Eigen::Vector3d axis = arm.axis_W(j, X_WL);
    auto column = jacobian.col(static_cast<Eigen::Index>(j));
    if (arm.joints()[j].type == JointType::kPrismatic) {
      column.head<3>() = axis;
    } else {
      column.head<3>() = axis.cross(point_W_m - arm.axis_point_W(j, X_WL));
      column.tail<3>() = axis;
    }
  }
  return jacobian;
}

}  // namespace phantom::robot
