#include "common/robot/kinematics/tool_wrench.hpp"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>
#include <random>

#include "tests/support/small_arms.hpp"

namespace phantom::robot {
namespace {

/// Torques of a wrench by the principle of virtual work: what it does over a small motion of each joint.
core::JointArray torques_of(const robot::SerialArm& arm, const core::JointArray& q,
                            const robot::Spatial& in_tool) {
  constexpr double kStep = 1e-6;
  core::JointArray torque{};
  const auto pose = [&](const core::JointArray& at) {
    robot::LinkPoses X_WL;
    arm.link_poses(at, X_WL);
    return robot::tool_pose(arm, X_WL);
  };
  const geometry::Pose X = pose(q);
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    core::JointArray more = q, less = q;
    more[j] += kStep, less[j] -= kStep;
    const geometry::Pose a = pose(less), b = pose(more);
    const Eigen::Vector3d moved = X.rotation.transpose() * (b.translation_m - a.translation_m);
    const Eigen::Vector3d turned =
        X.rotation.transpose() * geometry::rotation_vector(b.rotation * a.rotation.transpose());
    torque[j] = (in_tool.head<3>().dot(moved) + in_tool.tail<3>().dot(turned)) / (2.0 * kStep);
  }
  return torque;
}

TEST(ToolWrench, IsTheWrenchWhoseTorquesTheyAre) {
  const robot::SerialArm arm = phantom::test::six_joints();
  std::mt19937 random(3);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  int tried = 0;
  for (int k = 0; k < 50; ++k) {
    core::JointArray q{};
    for (std::size_t j = 0; j < 6; ++j) q[j] = 2.0 * number(random);
    robot::LinkPoses X_WL;
    arm.link_poses(q, X_WL);
    const Eigen::Matrix<double, 6, 6> J = robot::tool_jacobian(arm, X_WL).leftCols<6>();
    if (std::abs(J.determinant()) < 0.01) continue;  // near a singular pose the torques say less
    ++tried;
    robot::Spatial wrench;
    for (int i = 0; i < 6; ++i) wrench[i] = 10.0 * number(random);
    EXPECT_LT((wrench_at_tool(arm, q, torques_of(arm, q, wrench)) - wrench).norm(), 1e-5);
  }
  EXPECT_GT(tried, 10);
}

TEST(ToolWrench, ItsForceByDampedLeastSquaresIsThatOfTheWrenchAwayFromSingularPoses) {
  const robot::SerialArm arm = phantom::test::six_joints();
  std::mt19937 random(4);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  int tried = 0;
  for (int k = 0; k < 2000; ++k) {
    core::JointArray q{};
    for (std::size_t j = 0; j < 6; ++j) q[j] = 2.0 * number(random);
    robot::LinkPoses X_WL;
    arm.link_poses(q, X_WL);
    const Eigen::Matrix<double, 6, 6> J = robot::tool_jacobian(arm, X_WL).leftCols<6>();
    const Eigen::Matrix<double, 6, 1> gains = Eigen::JacobiSVD<Eigen::MatrixXd>(J).singularValues();
    robot::Spatial wrench = robot::Spatial::Zero();
    for (int i = 0; i < 3; ++i) wrench[i] = 100.0 * number(random);
    const double force_N = tool_force_N(arm, X_WL, torques_of(arm, q, wrench));
    EXPECT_LE(force_N, 1.001 * wrench.norm()) << "damping only lowers it";
    if (gains[5] < 0.08 * gains[0]) continue;
    ++tried;
    EXPECT_NEAR(force_N, wrench.norm(), 0.03 * wrench.norm());
  }
  EXPECT_GT(tried, 5);
  robot::LinkPoses X_WL;
  arm.link_poses({}, X_WL);
  EXPECT_EQ(tool_force_N(arm, X_WL, {std::nan("")}), 0.0);
}

TEST(ToolWrench, OfAnArmWithOneJointIsAForceThatItFeels) {
  const robot::SerialArm arm = phantom::test::one_joint();
  core::JointArray q{}, torque{};
  q[0] = 0.7;
  torque[0] = 3.0;
  const robot::Spatial wrench = wrench_at_tool(arm, q, torque);
  EXPECT_TRUE(wrench.allFinite());
  EXPECT_NEAR(torques_of(arm, q, wrench)[0], 3.0, 1e-6);
  EXPECT_LE(wrench.norm(), 3.0 / 0.5) << "the smallest: not more than a force alone at the arm of 0.5 m";
  EXPECT_NEAR(wrench[0], 0.0, 1e-12) << "along the forearm nothing is felt";
}

}  // namespace
}  // namespace phantom::robot
