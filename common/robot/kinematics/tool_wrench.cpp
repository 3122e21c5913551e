#include "common/robot/kinematics/tool_wrench.hpp"

#include <Eigen/QR>

namespace phantom::robot {

Spatial wrench_at_tool(const SerialArm& arm, const core::JointArray& position,
                       const core::JointArray& torque) {
  constexpr double kSingular = 1e-3;  // of the greatest direction's gain
  LinkPoses X_WL;
  arm.link_poses(position, X_WL);
  const auto joints = static_cast<Eigen::Index>(arm.joint_count());
  const Eigen::MatrixXd transposed = tool_jacobian(arm, X_WL).leftCols(joints).transpose();
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> solver;
  solver.setThreshold(kSingular);
  solver.compute(transposed);
  const Spatial in_world = solver.solve(Eigen::Map<const Eigen::VectorXd>(torque.data(), joints));
  const Eigen::Matrix3d R_TW = tool_pose(arm, X_WL).rotation.transpose();
  Spatial in_tool;
  in_tool << R_TW * in_world.head<3>(), R_TW * in_world.tail<3>();
  return in_tool;
}

}  // namespace phantom::robot
