#include "common/teleop/coupling/cartesian_map.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "common/robot/tests/test_arms.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::teleop {
namespace {

using Matrix = Eigen::MatrixXd;

CartesianMapParameters light(std::size_t joints) {
  CartesianMapParameters p{.joint_count = joints, .mass_kg = 1.0, .inertia_kg_m2 = 0.01};
  for (std::size_t j = 0; j < joints; ++j) p.inertia[j] = 0.0005 + 0.0003 * static_cast<double>(j);
  p.inertia[0] = 0.1;
  return p;
}

robot::Jacobian jacobian_at(const robot::SerialArm& arm, const core::JointArray& q) {
  robot::LinkPoses X_WL;
  arm.link_poses(q, X_WL);
  return robot::tool_jacobian(arm, X_WL);
}

core::JointArray all_used() {
  core::JointArray weight{};
  weight.fill(1.0);
  return weight;
}

struct Scaled {
  Matrix jacobian, root_mass, root_mobility;
};

Scaled scaled(const CartesianMapParameters& p, const robot::Jacobian& J, const core::JointArray& weight) {
  const auto n = static_cast<Eigen::Index>(p.joint_count);
  Eigen::VectorXd mass(6), mobility(n);
  mass << Eigen::Vector3d::Constant(p.mass_kg), Eigen::Vector3d::Constant(p.inertia_kg_m2);
  if (!p.orientation) mass.tail(3).setZero();
  for (Eigen::Index j = 0; j < n; ++j)
    mobility[j] = weight[static_cast<std::size_t>(j)] / p.inertia[static_cast<std::size_t>(j)];
  Scaled s{.jacobian = {},
           .root_mass = mass.cwiseSqrt().asDiagonal(),
           .root_mobility = mobility.cwiseSqrt().asDiagonal()};
  s.jacobian = s.root_mass * J.leftCols(n) * s.root_mobility;
  return s;
}

/// The same by singular values, as the header says it.
Matrix twin(const CartesianMapParameters& p, const robot::Jacobian& J, const core::JointArray& weight) {
  const Scaled s = scaled(p, J, weight);
  const Eigen::JacobiSVD<Matrix> svd(s.jacobian, Eigen::ComputeThinU | Eigen::ComputeThinV);
  Eigen::VectorXd h = svd.singularValues();
  for (double& one : h) one = one > 0.0 ? std::min({1.0 / one, 1.0, one / p.singular_below}) : 0.0;
  return s.root_mobility * svd.matrixV() * h.asDiagonal() * svd.matrixU().transpose() * s.root_mass;
}

/// Poses of the arm, random ones, and ones that are singular: straight, folded, and with parallel wrist axes.
template <class Body>
void in_many_poses(const robot::SerialArm& arm, const Body& body) {
  std::mt19937 random(3);
  for (int i = 0; i < 200; ++i) {
    core::JointArray q = robot::test_arms::random_joints(arm, random);
    if (i % 4 == 1) q[3] = 0.0;
    if (i % 4 == 2) q[2] = q[3] = q[5] = 0.0;
    if (i % 4 == 3) q[5] = 0.0;
    body(q, random);
  }
}

TEST(CartesianMap, IsTheInverseBySingularValues) {
  const auto arm = robot::test_arms::suspended();
  in_many_poses(arm, [&](const core::JointArray& q, std::mt19937& random) {
    auto p = light(7);
    p.orientation = random() % 4 != 0;
    core::JointArray weight{};
    for (std::size_t j = 0; j < 7; ++j)
      weight[j] = random() % 5 == 0 ? 0.0 : std::uniform_real_distribution(0.0, 1.0)(random);
    const auto J = jacobian_at(arm, q);
    CartesianMap map;
    {
      const test::HeapGuard guard;
      map = cartesian_map(p, J, weight);
    }
    const Matrix expected = twin(p, J, weight);
    EXPECT_LT((map.joints_per_twist.topRows(7) - expected).norm(), 1e-6 * (1.0 + expected.norm()));
    EXPECT_EQ(map.joints_per_twist.bottomRows(9).norm(), 0.0);
  });
}

TEST(CartesianMap, FollowsTheHandExactlyWhereTheArmCan) {
  const auto arm = robot::test_arms::suspended();
  int exact = 0, damped = 0;
  in_many_poses(arm, [&](const core::JointArray& q, std::mt19937&) {
    const auto p = light(7);
    const auto J = jacobian_at(arm, q);
    const auto map = cartesian_map(p, J, all_used());
    const Matrix followed = J * map.joints_per_twist;
    const Scaled s = scaled(p, J, all_used());
    const Eigen::JacobiSVD<Matrix> svd(s.jacobian);
    EXPECT_NEAR(
        map.least_followed,
        std::min({1.0, svd.singularValues()[5], std::pow(svd.singularValues()[5], 2) / p.singular_below}),
        1e-9);
    if (map.least_followed >= 1.0) {
      ++exact;
      EXPECT_LT((followed - Matrix::Identity(6, 6)).norm(), 1e-9);
    } else {
      ++damped;
    }
  });
  EXPECT_GT(exact, 20);
  EXPECT_GT(damped, 20);
}

// What the stability of gains and damping rests on, in every pose.
TEST(CartesianMap, NoJointFindsTheHandLighterThanItsInertiaSays) {
  const auto arm = robot::test_arms::suspended();
  double greatest = 0.0;
  in_many_poses(arm, [&](const core::JointArray& q, std::mt19937& random) {
    const auto p = light(7);
    core::JointArray weight = all_used();
    weight[random() % 7] = 0.3;
    const Matrix A = cartesian_map(p, jacobian_at(arm, q), weight).joints_per_twist.topRows(7);
    const Scaled s = scaled(p, {}, all_used());
    const Matrix scaled_map = s.root_mobility.inverse() * A * s.root_mass.inverse();
    const double norm = Eigen::JacobiSVD<Matrix>(scaled_map).singularValues()[0];
    EXPECT_LE(norm, 1.0 + 1e-9);
    greatest = std::max(greatest, norm);
  });
  EXPECT_GT(greatest, 0.9);
}

// A that jumped would be a step of the wrench.
TEST(CartesianMap, ChangesLittleWithThePoseThroughSingularOnes) {
  const auto arm = robot::test_arms::suspended();
  const auto p = light(7);
  in_many_poses(arm, [&](core::JointArray q, std::mt19937&) {
    for (const std::size_t joint : {std::size_t{3}, std::size_t{5}}) {
      const double middle = q[joint];
      Matrix before;
      for (int k = -20; k <= 20; ++k) {
        q[joint] = middle + 1e-4 * k;
        const Matrix now = cartesian_map(p, jacobian_at(arm, q), all_used()).joints_per_twist;
        if (k > -20) {
          EXPECT_LT((now - before).norm(), 0.3) << "in 0.1 mrad";
        }
        before = now;
      }
      q[joint] = middle;
    }
  });
}

TEST(CartesianMap, AnArmOfFewJointsDoesWhatItCan) {
  const auto arm = robot::test_arms::planar();
  auto p = light(2);
  p.inertia = {0.002, 0.002};
  const auto J = jacobian_at(arm, {0.3, 1.2});
  const auto map = cartesian_map(p, J, all_used());
  EXPECT_EQ(map.least_followed, 0.0);
  Spatial up = Spatial::Zero();
  up[2] = 1.0;
  EXPECT_LT((map.joints_per_twist * up).norm(), 1e-12);
  p.orientation = false;
  Spatial along = Spatial::Zero();
  along.head<2>() << 0.1, -0.05;
  EXPECT_LT((J * (cartesian_map(p, J, all_used()).joints_per_twist * along) - along).head<3>().norm(), 1e-9);
}

}  // namespace
}  // namespace phantom::teleop
