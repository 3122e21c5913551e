// Momentum and drift against Orocos KDL's mass matrix, its differences and its Coriolis torques.
#include "common/robot/kinematics/arm_dynamics.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <random>

#include "common/robot/tests/kdl_arm.hpp"
#include "common/robot/tests/test_arms.hpp"
#include "tests/support/heap_guard.hpp"

namespace phantom::robot {
namespace {

using core::JointArray;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

std::mt19937 randomness(17);
double number(double most) { return std::uniform_real_distribution(-most, most)(randomness); }
Vector3d triple(double most) { return {number(most), number(most), number(most)}; }
JointArray numbers(std::size_t count, double most) {
  JointArray values{};
  for (std::size_t j = 0; j < count; ++j) values[j] = number(most);
  return values;
}

std::string text(const Vector3d& v) {
  std::ostringstream stream;
  stream.precision(17);
  stream << v.x() << ' ' << v.y() << ' ' << v.z();
  return stream.str();
}

/// A slanted body, with the inertial's frame turned against the link's.
struct Body {
  double mass_kg = 0.5 + std::abs(number(5.0));
  Vector3d centre_m = triple(0.3), rpy_rad = triple(1.5);
  Matrix3d inertia = [] {  // of four points of mass, so that it is a body's
    Matrix3d sum = Matrix3d::Zero();
    for (int i = 0; i < 4; ++i) {
      const Vector3d p = triple(0.2);
      sum += p.squaredNorm() * Matrix3d::Identity() - p * p.transpose();
    }
    return sum;
  }();

  std::string inertial() const {
    std::ostringstream stream;
    stream.precision(17);
    stream << "<inertial><origin xyz=\"" << text(centre_m) << "\" rpy=\"" << text(rpy_rad)
           << "\"/><mass value=\"" << mass_kg << "\"/><inertia ixx=\"" << inertia(0, 0) << "\" ixy=\""
           << inertia(0, 1) << "\" ixz=\"" << inertia(0, 2) << "\" iyy=\"" << inertia(1, 1) << "\" iyz=\""
           << inertia(1, 2) << "\" izz=\"" << inertia(2, 2) << "\"/></inertial>";
    return stream.str();
  }
  KDL::RigidBodyInertia kdl() const {
    const Matrix3d R = geometry::rotation_from_rpy(rpy_rad.x(), rpy_rad.y(), rpy_rad.z());
    return kdl_body(mass_kg, centre_m, R * inertia * R.transpose());
  }
};

/// A random arm as we read it from a URDF, and as KDL puts it together. Every second link has a body fixed to
/// it, which has another fixed to itself.
struct Pair {
  SerialArm arm;
  KDL::Chain chain;
};

Pair random_pair(std::size_t joints) {
  const geometry::Pose X_WB{geometry::rotation_from_rpy(number(3), number(3), number(3)), triple(2.0)};
  std::string body = "<link name=\"l0\">" + Body().inertial() + "</link>";
  KDL::Chain chain;
  for (std::size_t i = 1; i <= joints; ++i) {
    const std::string n = std::to_string(i), link = "l" + n;
    const Body own, fixed, more;
    const Vector3d xyz = triple(0.5), rpy = triple(2.0), axis = triple(1.0);
    const bool slides = randomness() % 4 == 0;
    body += "<link name=\"" + link + "\">" + own.inertial() + "</link>" +
            test_arms::moving_joint("j" + n, slides ? "prismatic" : "revolute", "l" + std::to_string(i - 1),
                                    link, text(xyz), text(rpy), text(axis), 2.0);
    KDL::RigidBodyInertia carried = own.kdl();
    if (i % 2 == 0) {
      std::string parent = link;
      KDL::Frame at;
      for (const Body* part : {&fixed, &more}) {
        const Vector3d part_xyz = triple(0.3), part_rpy = triple(2.0);
        const std::string name = parent + "p";
        body.append("<link name=\"" + name + "\">" + part->inertial() + "</link><joint name=\"" + name +
                    "_mount\" type=\"fixed\"><parent link=\"" + parent + "\"/><child link=\"" + name +
                    "\"/><origin xyz=\"" + text(part_xyz) + "\" rpy=\"" + text(part_rpy) + "\"/></joint>");
        at = at * KDL::Frame(KDL::Rotation::RPY(part_rpy.x(), part_rpy.y(), part_rpy.z()), kdl_of(part_xyz));
        carried = carried + at * part->kdl();
        parent = name;
      }
    }
    Joint joint;
    joint.type = slides ? JointType::kPrismatic : JointType::kRevolute;
    joint.axis = axis.normalized();
    joint.X_parent_joint = {geometry::rotation_from_rpy(rpy.x(), rpy.y(), rpy.z()), xyz};
    chain.addSegment(kdl_segment(joint, carried));
  }
  return {test_arms::load(body, "l" + std::to_string(joints), X_WB), chain};
}

struct Case {
  explicit Case(const Pair& pair)
      : arm(pair.arm),
        count(pair.arm.joint_count()),
        rotor(numbers(count, 1.0)),
        q(numbers(count, 2.0)),
        v(numbers(count, 3.0)),
        kdl(pair.chain, pair.arm.base_pose(), rotor) {}

  ArmMomentum ours(const JointArray& at_v) const {
    LinkPoses X_WL;
    arm.link_poses(q, X_WL);
    return momentum_of(arm, rotor, X_WL, at_v);
  }
  MatrixXd mass_beside(std::size_t joint, double step) {
    JointArray beside = q;
    beside[joint] += step;
    return kdl.mass(beside);
  }
  VectorXd v_vector() const { return vector_of(v, static_cast<Eigen::Index>(count)); }

  SerialArm arm;
  std::size_t count;
  JointArray rotor, q, v;
  KdlDynamics kdl;
};

void near(const JointArray& ours, const VectorXd& expected, double share, const char* what = "") {
  const double most = share * (1.0 + expected.cwiseAbs().maxCoeff());
  for (Eigen::Index j = 0; j < expected.size(); ++j)
    EXPECT_NEAR(ours[static_cast<std::size_t>(j)], expected[j], most) << what << "joint " << j;
}

class RandomArm : public testing::TestWithParam<std::size_t> {};

TEST_P(RandomArm, MomentumIsKdlsMassMatrixTimesVelocity) {
  for (int trial = 0; trial < 20; ++trial) {
    Case arm(random_pair(GetParam()));
    near(arm.ours(arm.v).momentum, arm.kdl.mass(arm.q) * arm.v_vector(), 1e-11);
  }
}

// The drift by its definition, ∂(½vᵀMv)/∂q, and by what C is chosen for: Cᵀv = (dM/dt)v − Cv.
TEST_P(RandomArm, DriftIsTheDerivativeOfKineticEnergyAndWhatCoriolisTorquesLeave) {
  constexpr double kStep = 1e-5;
  for (int trial = 0; trial < 20; ++trial) {
    Case arm(random_pair(GetParam()));
    const VectorXd v = arm.v_vector();
    VectorXd derivative(v.size()), mass_rate_v = VectorXd::Zero(v.size());
    for (std::size_t j = 0; j < arm.count; ++j) {
      const MatrixXd slope = (arm.mass_beside(j, kStep) - arm.mass_beside(j, -kStep)) / (2.0 * kStep);
      derivative[static_cast<Eigen::Index>(j)] = 0.5 * v.dot(slope * v);
      mass_rate_v += slope * v * arm.v[j];
    }
    const JointArray drift = arm.ours(arm.v).drift;
    near(drift, derivative, 1e-7, "derivative ");
    near(drift, mass_rate_v - arm.kdl.coriolis(arm.q, arm.v), 1e-7);
  }
}

TEST_P(RandomArm, WeightIsKdls) {
  Case arm(random_pair(GetParam()));
  LinkPoses X_WL;
  arm.arm.link_poses(arm.q, X_WL);
  near(arm.arm.gravity_torque(X_WL), arm.kdl.weight(arm.q), 1e-11);
}

TEST_P(RandomArm, TheMassMatrixItImpliesIsSymmetricAndPositive) {
  Case arm(random_pair(GetParam()));
  arm.rotor = {};
  MatrixXd mass(arm.count, arm.count);
  for (std::size_t j = 0; j < arm.count; ++j) {
    JointArray unit{};
    unit[j] = 1.0;
    mass.col(static_cast<Eigen::Index>(j)) =
        vector_of(arm.ours(unit).momentum, static_cast<Eigen::Index>(arm.count));
  }
  EXPECT_TRUE(mass.isApprox(mass.transpose(), 1e-12));
  EXPECT_EQ(mass.ldlt().info(), Eigen::Success);
  EXPECT_GT(mass.ldlt().vectorD().minCoeff(), 0.0);
}

INSTANTIATE_TEST_SUITE_P(Joints, RandomArm, testing::Values(1, 2, 3, 7, 16));

// A free arm keeps its energy, whatever it does: integrated by momentum (Hamilton's equations).
TEST(ArmDynamics, AFreeArmKeepsItsEnergy) {
  const SerialArm arm = test_arms::suspended();
  const std::size_t count = arm.joint_count();
  const auto n = static_cast<Eigen::Index>(count);
  const JointArray rotor{};
  JointArray q = numbers(count, 0.3), v = numbers(count, 1.0);
  LinkPoses X_WL;
  const auto solve = [&](const VectorXd& p) {
    MatrixXd mass(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      JointArray unit{};
      unit[static_cast<std::size_t>(j)] = 1.0;
      mass.col(j) = vector_of(momentum_of(arm, rotor, X_WL, unit).momentum, n);
    }
    const VectorXd solved = mass.ldlt().solve(p);
    for (Eigen::Index j = 0; j < n; ++j) v[static_cast<std::size_t>(j)] = solved[j];
  };
  const auto energy_J = [&] {
    double height_J = 0.0;
    for (std::size_t i = 1; i <= count; ++i)
      height_J += arm.links()[i].mass_kg * 9.80665 * (X_WL[i] * arm.links()[i].centre_of_mass_m).z();
    return height_J + 0.5 * vector_of(momentum_of(arm, rotor, X_WL, v).momentum, n).dot(vector_of(v, n));
  };
  arm.link_poses(q, X_WL);
  VectorXd p = vector_of(momentum_of(arm, rotor, X_WL, v).momentum, n);
  const double before_J = energy_J();
  double fastest = 0.0;
  constexpr double kDt = 2e-5;
  for (int i = 0; i < 25000; ++i) {  // the midpoint rule
    const VectorXd p0 = p;
    const JointArray q0 = q;
    for (const double step : {0.5 * kDt, kDt}) {
      const VectorXd rate =
          vector_of(momentum_of(arm, rotor, X_WL, v).drift, n) - vector_of(arm.gravity_torque(X_WL), n);
      for (std::size_t j = 0; j < count; ++j) q[j] = q0[j] + step * v[j];
      p = p0 + step * rate;
      arm.link_poses(q, X_WL);
      solve(p);
    }
    fastest = std::max(fastest, vector_of(v, n).cwiseAbs().maxCoeff());
  }
  EXPECT_GT(fastest, 1.0) << "it fell and swung";
  EXPECT_NEAR(energy_J(), before_J, 1e-3);
}

TEST(ArmDynamics, InertiasOfDhRowsAreInTheRowsFrame) {
  std::vector<DhRow> rows(3);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Body body;
    rows[i].link = "l" + std::to_string(i);
    rows[i].theta_rad = number(3), rows[i].alpha_rad = number(3), rows[i].a_m = number(0.5),
    rows[i].d_m = number(0.5);
    rows[i].lower = -2, rows[i].upper = 2, rows[i].max_speed = rows[i].max_effort = 1;
    rows[i].mass_kg = body.mass_kg, rows[i].centre_of_mass_m = body.centre_m,
    rows[i].inertia_kg_m2 = body.inertia;
  }
  KDL::Chain chain;  // KDL's frame of a classic row: z of the one before turns, the inertia is in its own
  for (const DhRow& row : rows)
    chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::RotZ),
                                  KDL::Frame::DH(row.a_m, row.alpha_rad, row.d_m, row.theta_rad),
                                  kdl_body(row.mass_kg, row.centre_of_mass_m, row.inertia_kg_m2)));
  const auto arm = SerialArm::from_dh(rows, DhConvention::kClassic, {});
  ASSERT_TRUE(arm) << arm.status().message();
  Case same({*arm, chain});
  near(same.ours(same.v).momentum, same.kdl.mass(same.q) * same.v_vector(), 1e-11);
  rows[1].inertia_kg_m2(0, 0) = -1.0;
  const auto refused = SerialArm::from_dh(rows, DhConvention::kClassic, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.status().message(),
            "DH table: row 2: inertia must be finite, with no principal moment below 0");
}

TEST(ArmDynamics, AnInertiaThatNoBodyHasIsRefused) {
  const auto file = test_arms::write_urdf(
      R"(<link name="base"/><link name="l1"><inertial><mass value="1"/><inertia ixx="-1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>)" +
      test_arms::moving_joint("j1", "revolute", "base", "l1", "0 0 0", "0 0 0", "0 0 1", 1));
  const auto arm = SerialArm::from_urdf(file, "l1", {});
  ASSERT_FALSE(arm);
  EXPECT_NE(
      arm.status().message().find("link 'l1': inertia must be finite, with no principal moment below 0"),
      std::string::npos)
      << arm.status().message();
  Matrix3d inertia = Matrix3d::Identity();
  EXPECT_TRUE(is_inertia(inertia));
  inertia(0, 1) = 0.1;
  EXPECT_FALSE(is_inertia(inertia)) << "not symmetric";
  inertia(0, 1) = inertia(1, 0) = std::nan("");
  EXPECT_FALSE(is_inertia(inertia));
}

TEST(ArmDynamics, UsesNoHeap) {
  const SerialArm arm = test_arms::suspended();
  LinkPoses X_WL;
  arm.link_poses({}, X_WL);
  const JointArray v = numbers(7, 1.0);
  const test::HeapGuard guard;
  EXPECT_TRUE(core::all_finite(momentum_of(arm, {}, X_WL, v).momentum, 7));
}

/// An arm of three joints that carries a body at a slanted frame of its last link: as a link that is fixed
/// there, or, if `massless`, as a frame only.
SerialArm arm_with_body(bool massless) {
  using namespace test_arms;
  const std::string inertial =
      massless
          ? ""
          : "<inertial><origin xyz=\"0.02 -0.03 0.05\"/><mass value=\"2.5\"/><inertia ixx=\"0.02\" ixy=\"0.003\" "
            "ixz=\"-0.002\" iyy=\"0.03\" iyz=\"0.001\" izz=\"0.025\"/></inertial>";
  return load(
      link("base", 0, "0 0 0") + link("l1", 3, "0.1 0 -0.1") + link("l2", 2, "0 0.1 -0.1") +
          link("l3", 1, "0 0 -0.1") + "<link name=\"held\">" + inertial + "</link>" +
          moving_joint("j1", "revolute", "base", "l1", "0 0 0", "0.1 0 0", "0 1 0", 3) +
          moving_joint("j2", "prismatic", "l1", "l2", "0.02 0 -0.35", "0 0 0.2", "1 0 0", 1) +
          moving_joint("j3", "revolute", "l2", "l3", "0 0 -0.3", "0 0 0", "0 0.6 0.8", 3) +
          R"(<joint name="f" type="fixed"><parent link="l3"/><child link="held"/><origin xyz="0.1 0.05 -0.2" rpy="0.3 -0.4 0.5"/></joint>)",
      "l3", at(0.1, 0.2, 1.0));
}

TEST(Payload, ActsAsALinkThatIsFixedToTheArm) {
  const SerialArm whole = arm_with_body(false), bare = arm_with_body(true);
  const auto [link, X_LF] = *bare.find_frame("held");
  Matrix3d inertia;
  inertia << 0.02, 0.003, -0.002, 0.003, 0.03, 0.001, -0.002, 0.001, 0.025;
  Payload payload;
  // In two parts: bodies of one link are one body.
  add_body(payload, link, 1.0, X_LF * Vector3d(0.02, -0.03, 0.05),
           X_LF.rotation * (inertia * 0.4) * X_LF.rotation.transpose());
  add_body(payload, link, 1.5, X_LF * Vector3d(0.02, -0.03, 0.05),
           X_LF.rotation * (inertia * 0.6) * X_LF.rotation.transpose());
  EXPECT_DOUBLE_EQ(payload.mass_kg(), 2.5);
  for (int i = 0; i < 100; ++i) {
    const JointArray q = numbers(3, 1.0), v = numbers(3, 2.0), rotor = numbers(3, 0.0);
    LinkPoses X_WL;
    bare.link_poses(q, X_WL);
    const test::HeapGuard guard;
    const ArmMomentum with = momentum_of(bare, rotor, X_WL, v, payload),
                      as_link = momentum_of(whole, rotor, X_WL, v);
    JointArray weight = bare.gravity_torque(X_WL);
    add_weight(bare, payload, X_WL, weight);
    const JointArray expected = whole.gravity_torque(X_WL);
    for (std::size_t j = 0; j < 3; ++j) {
      EXPECT_NEAR(with.momentum[j], as_link.momentum[j], 1e-12);
      EXPECT_NEAR(with.drift[j], as_link.drift[j], 1e-12);
      EXPECT_NEAR(weight[j], expected[j], 1e-12);
    }
  }
}

}  // namespace
}  // namespace phantom::robot
