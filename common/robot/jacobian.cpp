#include "common/robot/jacobian.hpp"

#include <Eigen/Geometry>

namespace phantom::robot {

geometry::Pose tool_pose(const SerialArm& arm, const LinkPoses& X_WL) noexcept {
  const std::size_t last = arm.joint_count();
  return {X_WL[last].rotation, X_WL[last] * arm.link_axis_m(last).second};
}

Jacobian tool_jacobian(const SerialArm& arm, const LinkPoses& X_WL) noexcept {
  Jacobian jacobian = Jacobian::Zero();
  const Eigen::Vector3d tool_m = tool_pose(arm, X_WL).translation_m;
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    const Eigen::Vector3d axis = arm.axis_W(j, X_WL);
    auto column = jacobian.col(static_cast<Eigen::Index>(j));
    if (arm.joints()[j].type == JointType::kPrismatic) {
      column.head<3>() = axis;
    } else {
      column.head<3>() = axis.cross(tool_m - arm.axis_point_W(j, X_WL));
      column.tail<3>() = axis;
    }
  }
  return jacobian;
}

}  // namespace phantom::robot
