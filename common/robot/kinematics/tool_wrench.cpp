#include "common/robot/kinematics/tool_wrench.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "common/geometry/symmetric_matrix.hpp"

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

double tool_force_N(const SerialArm& arm, const LinkPoses& X_WL, const core::JointArray& torque) noexcept {
  constexpr double kDamping = 0.01;
  const Jacobian J = tool_jacobian(arm, X_WL);
  geometry::Matrix6 gains = J * J.transpose();
  gains.diagonal().array() += kDamping * kDamping * gains.trace();
  const Eigen::Map<const Eigen::Matrix<double, static_cast<int>(core::kMaxJoints), 1>> tau(torque.data());
  const double force_N = geometry::solve_symmetric(gains, J * tau).head<3>().norm();
  return std::isfinite(force_N) ? force_N : 0.0;
}

}  // namespace phantom::robot
