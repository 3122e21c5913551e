// The ten sums and the composite-body algorithm against the thesis's double sums, written out literally.
#include "common/robot/drag/drag.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

#include "common/robot/tests/drag_rig.hpp"

namespace phantom::robot::drag_test {
namespace {

using core::JointArray;
using drag_rig::Rig;
using test_arms::random_joints;

/// Thesis 5.29–5.35, C.9–C.13, word by word: for each joint l, over links u ≥ l, over the link's sensors,
/// μ·θ'·D·D with D the distance of the sensor from the joint's axis; a translation adds V·μ. Per unit of
/// velocity.
JointArray literal_drag(const Rig& rig) {
  JointArray result{};
  for (std::size_t l = 0; l < rig.arm.joint_count(); ++l) {
    const Eigen::Vector3d axis = rig.arm.axis_W(l, rig.X_WL), point = rig.arm.axis_point_W(l, rig.X_WL);
    for (std::size_t u = l + 1; u <= rig.arm.joint_count(); ++u) {
      double torque_of_link = 0.0;
      std::size_t contributing = 0;
      for (std::size_t s = rig.layout.first[u]; s < rig.layout.first[u + 1]; ++s) {
        const Eigen::Vector3d css = rig.X_WL[u] * rig.layout.position(s);
        const double mu = static_cast<double>(rig.world.mu(rig.world.grid().index_of(css)));
        if (mu > 0.0) ++contributing;
        const double distance = axis.cross(css - point).norm();
        const double lever = rig.arm.joints()[l].type == JointType::kPrismatic ? 1.0 : distance * distance;
        torque_of_link += mu * rig.layout.weight[s] * lever;
      }
      if (rig.layout.normalisation == Normalisation::kActive && contributing > 0) {
        torque_of_link /= static_cast<double>(contributing);
      }
      result[l] += torque_of_link;
    }
  }
  return result;
}

TEST(Drag, SeparableCoefficientsAreTheThesissDoubleSums) {
  for (const auto normalisation :
       {Normalisation::kArea, Normalisation::kCount, Normalisation::kActive, Normalisation::kNone}) {
    Rig rig(normalisation);
    std::mt19937 random(7);
    double greatest = 0.0;
    for (int trial = 0; trial < 15; ++trial) {
      const DragCoefficients& drag = rig.at(random_joints(rig.arm, random));
      const JointArray expected = literal_drag(rig);
      for (std::size_t l = 0; l < core::kMaxJoints; ++l) {
        EXPECT_NEAR(drag.plus[l], expected[l], 1e-9 * expected[l] + 1e-15) << "joint " << l;
        EXPECT_EQ(drag.plus[l], drag.minus[l]);
        greatest = std::max(greatest, expected[l]);
      }
    }
    EXPECT_GT(greatest, 0.0);  // else nothing was compared
  }
}

TEST(Drag, CoupledMatrixIsTheLiteralSumOfJacobians) {
  Rig rig;
  std::mt19937 random(8);
  for (int trial = 0; trial < 5; ++trial) {
    const DragCoefficients& drag = rig.at(random_joints(rig.arm, random));
    const std::size_t n = rig.arm.joint_count();
    Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(7, 7);
    for (std::size_t s = 0; s < rig.layout.size(); ++s) {
      const std::size_t link = rig.layout.link_of(s);
      const Eigen::Vector3d p = rig.X_WL[link] * rig.layout.position(s);
      const double w = rig.layout.weight[s] * static_cast<double>(rig.world.mu(rig.world.grid().index_of(p)));
      Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(3, 7);
      for (std::size_t j = 0; j < n; ++j) {
        JointArray unit{};
        unit[j] = 1.0;
        jacobian.col(static_cast<Eigen::Index>(j)) = rig.arm.point_velocity_W(link, p, rig.X_WL, unit);
      }
      expected += w * jacobian.transpose() * jacobian;
    }
    Eigen::MatrixXd actual(7, 7);
    for (Eigen::Index i = 0; i < 7; ++i) {
      for (Eigen::Index j = 0; j < 7; ++j)
        actual(i, j) = drag.matrix(static_cast<std::size_t>(i), static_cast<std::size_t>(j));
    }
    EXPECT_LT((actual - expected).cwiseAbs().maxCoeff(), 1e-9 * expected.cwiseAbs().maxCoeff() + 1e-15);
    const Eigen::VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(actual).eigenvalues();
    EXPECT_GE(eigenvalues.minCoeff(), -1e-12 * eigenvalues.maxCoeff()) << "not positive semi-definite";
    for (std::size_t i = 0; i < n; ++i) EXPECT_EQ(drag.matrix(i, i), drag.plus[i]);
    for (std::size_t k = n * (n + 1) / 2; k < kPackedMatrix; ++k) EXPECT_EQ(drag.coupled[k], 0.0);
  }
}

TEST(Drag, IsTheSameWhenBaseAndWorldMoveTogetherByWholeVoxels) {
  const Eigen::Vector3d shift(0.17, -0.05, 0.32);
  Rig here, there(Normalisation::kArea, shift);
  std::mt19937 random(9);
  for (int trial = 0; trial < 10; ++trial) {
    const JointArray q = random_joints(here.arm, random);
    const DragCoefficients& a = here.at(q, {.enabled = true});
    const DragCoefficients& b = there.at(q, {.enabled = true});
    for (std::size_t i = 0; i < 7; ++i) {
      EXPECT_NEAR(a.plus[i], b.plus[i], 1e-9 * a.plus[i] + 1e-12);
      EXPECT_NEAR(a.minus[i], b.minus[i], 1e-9 * a.minus[i] + 1e-12);
    }
  }
}

TEST(Drag, ShiftingSumsIsTakingThemElsewhere) {
  std::mt19937 random(10);
  std::normal_distribution<double> normal;
  ViscousSums here, there;
  const Eigen::Vector3d offset(0.3, -0.2, 0.5);
  for (int i = 0; i < 50; ++i) {
    const double mu = std::abs(normal(random));
    const Eigen::Vector3d d(normal(random), normal(random), normal(random)),
        g(normal(random), normal(random), normal(random));
    for (auto [sums, at] :
         {std::pair{&here, d}, std::pair<ViscousSums*, Eigen::Vector3d>{&there, d + offset}}) {
      sums->add({mu, mu * at, mu * at * at.transpose(), g, at.cross(g), g.squaredNorm() / mu});
    }
  }
  here.shift_by(offset);
  EXPECT_TRUE(here.mu_d.isApprox(there.mu_d, 1e-12));
  EXPECT_TRUE(here.mu_dd.isApprox(there.mu_dd, 1e-12));
  EXPECT_TRUE(here.gradient_moment.isApprox(there.gradient_moment, 1e-12));
}

TEST(DragTorque, NeverDoesPositiveWorkInEitherMode) {
  Rig rig;
  std::mt19937 random(14);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 40; ++trial) {
    JointArray v{}, other{};  // also at another velocity than the one that the coefficients were taken at
    for (std::size_t i = 0; i < 7; ++i) v[i] = normal(random), other[i] = normal(random);
    const DragCoefficients& drag =
        rig.at(random_joints(rig.arm, random), {.enabled = trial % 2 == 0}, trial % 4 < 2 ? v : other);
    for (const DragMode mode : {DragMode::kSeparable, DragMode::kCoupled}) {
      const JointArray torque = drag_torque(drag, mode, v, 7);
      double power = 0.0, scale = 0.0;
      for (std::size_t i = 0; i < 7; ++i) power += torque[i] * v[i], scale += std::abs(torque[i] * v[i]);
      EXPECT_LE(power, 1e-12 * scale);
    }
  }
}

TEST(DragTorque, ModesAgreeForASingleMovingJoint) {
  Rig rig;
  std::mt19937 random(15);
  const DragCoefficients& drag = rig.at(random_joints(rig.arm, random), {.enabled = true});
  for (std::size_t j = 0; j < 7; ++j) {
    JointArray v{};
    v[j] = -0.7;
    EXPECT_NEAR(drag_torque(drag, DragMode::kSeparable, v, 7)[j],
                drag_torque(drag, DragMode::kCoupled, v, 7)[j], 1e-12);
  }
}

}  // namespace
}  // namespace phantom::robot::drag_test
