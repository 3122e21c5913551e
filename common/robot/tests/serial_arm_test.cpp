// The arm against analytic results, finite differences and virtual work; every refused URDF by its fault.
#include "common/robot/kinematics/serial_arm.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "common/robot/tests/test_arms.hpp"

namespace phantom::robot {
namespace {

using core::JointArray;
using testing::HasSubstr;

TEST(SerialArm, TwoLinkArmIsWhereTrigonometryPutsIt) {
  const SerialArm arm = test_arms::planar();
  ASSERT_EQ(arm.joint_count(), 2U);
  LinkPoses X_WL;
  arm.link_poses({0.3, 0.5}, X_WL);
  const auto [link, X_link_tip] = *arm.find_frame("tip");
  EXPECT_EQ(link, 2U);
  const Eigen::Vector3d tip = X_WL[link] * X_link_tip.translation_m;
  EXPECT_NEAR(tip.x(), 0.4 * std::cos(0.3) + 0.3 * std::cos(0.8), 1e-12);
  EXPECT_NEAR(tip.y(), 0.4 * std::sin(0.3) + 0.3 * std::sin(0.8), 1e-12);
  EXPECT_NEAR(tip.z(), 0.0, 1e-12);
  EXPECT_TRUE(arm.axis_W(1, X_WL).isApprox(Eigen::Vector3d::UnitZ(), 1e-12));
  EXPECT_TRUE(arm.axis_point_W(1, X_WL).isApprox(Eigen::Vector3d(0.4 * std::cos(0.3), 0.4 * std::sin(0.3), 0),
                                                 1e-12));
}

TEST(SerialArm, PrismaticJointMovesAlongItsTurnedAxis) {
  const SerialArm arm = test_arms::suspended();
  LinkPoses X_WL;
  JointArray q{};
  arm.link_poses(q, X_WL);
  const Eigen::Vector3d before = X_WL[1].translation_m;
  q[0] = 0.25;
  arm.link_poses(q, X_WL);
  EXPECT_TRUE((X_WL[1].translation_m - before).isApprox(0.25 * arm.axis_W(0, X_WL), 1e-12));
}

TEST(SerialArm, PointVelocityIsTheDerivativeOfPosition) {
  const SerialArm arm = test_arms::suspended();
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 20; ++trial) {
    const JointArray q = test_arms::random_joints(arm, random);
    JointArray v{};
    for (std::size_t i = 0; i < arm.joint_count(); ++i) v[i] = normal(random);
    for (std::size_t link = 0; link <= arm.joint_count(); ++link) {
      const Eigen::Vector3d p_L(0.1 * normal(random), 0.1 * normal(random), 0.1 * normal(random));
      const double h = 1e-6;
      JointArray before = q, after = q;
      for (std::size_t i = 0; i < arm.joint_count(); ++i) before[i] -= h * v[i], after[i] += h * v[i];
      LinkPoses X_before, X_now, X_after;
      arm.link_poses(before, X_before);
      arm.link_poses(q, X_now);
      arm.link_poses(after, X_after);
      const Eigen::Vector3d expected = (X_after[link] * p_L - X_before[link] * p_L) / (2 * h);
      const Eigen::Vector3d velocity = arm.point_velocity_W(link, X_now[link] * p_L, X_now, v);
      EXPECT_LT((velocity - expected).norm(), 1e-7) << "link " << link;
    }
  }
}

TEST(SerialArm, AForceDoesTheSameWorkOnJointsAsOnItsPoint) {
  const SerialArm arm = test_arms::suspended();
  std::mt19937 random(2);
  std::normal_distribution<double> normal;
  for (std::size_t link = 0; link <= arm.joint_count(); ++link) {
    LinkPoses X_WL;
    arm.link_poses(test_arms::random_joints(arm, random), X_WL);
    const Eigen::Vector3d point(normal(random), normal(random), normal(random));
    const Eigen::Vector3d force(normal(random), normal(random), normal(random));
    JointArray v{}, tau{};
    for (std::size_t i = 0; i < arm.joint_count(); ++i) v[i] = normal(random);
    arm.add_force(link, point, force, X_WL, tau);
    double power = 0.0;
    for (std::size_t i = 0; i < arm.joint_count(); ++i) power += tau[i] * v[i];
    EXPECT_NEAR(power, force.dot(arm.point_velocity_W(link, point, X_WL, v)), 1e-12);
    for (std::size_t i = link; i < core::kMaxJoints; ++i) EXPECT_EQ(tau[i], 0.0);
  }
}

TEST(SerialArm, GravityTorqueIsTheGradientOfPotentialEnergy) {
  const SerialArm arm = test_arms::suspended();
  const auto energy = [&](const JointArray& q) {
    LinkPoses X_WL;
    arm.link_poses(q, X_WL);
    double sum = 0.0;
    for (std::size_t i = 1; i < arm.links().size(); ++i) {
      sum += arm.links()[i].mass_kg * 9.80665 * (X_WL[i] * arm.links()[i].centre_of_mass_m).z();
    }
    return sum;
  };
  std::mt19937 random(3);
  for (int trial = 0; trial < 10; ++trial) {
    const JointArray q = test_arms::random_joints(arm, random);
    LinkPoses X_WL;
    arm.link_poses(q, X_WL);
    const JointArray tau = arm.gravity_torque(X_WL);
    for (std::size_t i = 0; i < arm.joint_count(); ++i) {
      JointArray before = q, after = q;
      before[i] -= 1e-6, after[i] += 1e-6;
      EXPECT_NEAR(tau[i], (energy(after) - energy(before)) / 2e-6, 1e-6) << "joint " << i;
    }
  }
}

TEST(SerialArm, FixedLinksBecomePartOfTheLinkThatCarriesThem) {
  const SerialArm arm = test_arms::load(R"(
    <link name="base"/><link name="stand"/>
    <link name="upper"><inertial><mass value="2"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
    <link name="motor"><inertial><origin xyz="0 0 1"/><mass value="6"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
    <link name="lower"/>
    <joint name="f" type="fixed"><parent link="base"/><child link="stand"/><origin xyz="0 0 2"/></joint>
    <joint name="a" type="revolute"><parent link="stand"/><child link="upper"/><origin xyz="1 0 0"/><axis xyz="0 0 2"/>
      <limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
    <joint name="g" type="fixed"><parent link="upper"/><child link="motor"/><origin xyz="0 0 3"/></joint>
    <joint name="b" type="continuous"><parent link="motor"/><child link="lower"/><origin xyz="0 1 0"/><axis xyz="1 0 0"/>
      <limit velocity="1" effort="1"/></joint>)",
                                        "lower");
  ASSERT_EQ(arm.joint_count(), 2U);
  EXPECT_EQ(arm.links()[1].name, "upper");
  EXPECT_TRUE(arm.joints()[0].X_parent_joint.translation_m.isApprox(Eigen::Vector3d(1, 0, 2)));
  EXPECT_TRUE(arm.joints()[0].axis.isApprox(Eigen::Vector3d::UnitZ()));
  EXPECT_TRUE(arm.joints()[1].X_parent_joint.translation_m.isApprox(Eigen::Vector3d(0, 1, 3)));
  EXPECT_EQ(arm.joints()[1].upper, std::numeric_limits<double>::infinity());
  EXPECT_DOUBLE_EQ(arm.links()[1].mass_kg, 8.0);
  EXPECT_TRUE(arm.links()[1].centre_of_mass_m.isApprox(Eigen::Vector3d(0, 0, 3)));  // (2·0 + 6·4) / 8
  EXPECT_EQ(arm.find_frame("motor")->first, 1U);
  EXPECT_TRUE(arm.find_frame("motor")->second.translation_m.isApprox(Eigen::Vector3d(0, 0, 3)));
  EXPECT_FALSE(arm.find_frame("elsewhere"));
}

// ---- what is refused
// -----------------------------------------------------------------------------------------------

const char* const kLimit = R"(<limit lower="-1" upper="1" velocity="1" effort="1"/>)";

std::string one_joint(const std::string& type, const std::string& inner) {
  return R"(<link name="base"/><link name="tip"/><joint name="shoulder" type=")" + type +
         R"("><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>)" + inner + "</joint>";
}

std::string urdf_refusal(const std::string& body, const std::string& tip = "tip") {
  const auto arm = SerialArm::from_urdf(test_arms::write_urdf(body), tip, {});
  EXPECT_FALSE(arm.has_value());
  EXPECT_THAT(arm.status().message(), HasSubstr(".urdf: "));
  return arm.status().message();
}

TEST(SerialArmRefuses, AFileThatIsNotThere) {
  const auto arm = SerialArm::from_urdf("/no/such/arm.urdf", "tip", {});
  ASSERT_FALSE(arm.has_value());
  EXPECT_EQ(arm.status().code(), core::ErrorCode::kNotFound);
  EXPECT_THAT(arm.status().message(), HasSubstr("/no/such/arm.urdf"));
}

TEST(SerialArmRefuses, WhatIsNotXml) {
  EXPECT_THAT(urdf_refusal("<link name="), HasSubstr("not a usable URDF"));
}

TEST(SerialArmRefuses, AnUnknownTipLink) {
  EXPECT_THAT(urdf_refusal(one_joint("revolute", kLimit), "hand"),
              HasSubstr("'hand' is not in the file; its links are: base, tip"));
}

TEST(SerialArmRefuses, SeventeenMovingJoints) {
  std::string body = R"(<link name="l0"/>)";
  for (int i = 1; i <= 17; ++i) {
    const std::string n = std::to_string(i);
    body += R"(<link name="l)" + n + R"("/><joint name="j)" + n + R"(" type="revolute"><parent link="l)" +
            std::to_string(i - 1) + R"("/><child link="l)" + n + R"("/><axis xyz="0 0 1"/>)" + kLimit +
            "</joint>";
  }
  EXPECT_THAT(urdf_refusal(body, "l17"), HasSubstr("17 moving joints"));
}

TEST(SerialArmRefuses, MissingLimits) {
  EXPECT_THAT(urdf_refusal(one_joint("revolute", "")), HasSubstr("shoulder"));
  EXPECT_THAT(urdf_refusal(one_joint("continuous", "")), HasSubstr("joint 'shoulder' has no <limit>"));
}

TEST(SerialArmRefuses, LimitsThatCannotBe) {
  EXPECT_THAT(urdf_refusal(one_joint("revolute", R"(<limit lower="1" upper="-1" velocity="1" effort="1"/>)")),
              HasSubstr("limit lower must be less than upper"));
  EXPECT_THAT(urdf_refusal(one_joint("revolute", R"(<limit lower="-1" upper="1" velocity="0" effort="1"/>)")),
              HasSubstr("limit velocity must be above 0"));
}

TEST(SerialArmRefuses, JointTypesThatASerialArmDoesNotHave) {
  EXPECT_THAT(urdf_refusal(one_joint("floating", kLimit)),
              HasSubstr("unsupported type; allowed are revolute"));
  EXPECT_THAT(urdf_refusal(one_joint("planar", kLimit)),
              HasSubstr("joint 'shoulder' has an unsupported type"));
}

TEST(SerialArmRefuses, AChainWithoutMotion) {
  EXPECT_THAT(urdf_refusal(one_joint("fixed", "")), HasSubstr("no joint moves"));
}

TEST(SerialArmRefuses, AMissingMesh) {
  const std::string mesh =
      R"(<visual><geometry><mesh filename="package://arm/meshes/none.stl"/></geometry></visual>)";
  const auto arm = SerialArm::from_urdf(
      test_arms::write_urdf(R"(<link name="base">)" + mesh + R"(</link><link name="tip"/>)" +
                            one_joint("revolute", kLimit)
                                .substr(std::string(R"(<link name="base"/><link name="tip"/>)").size())),
      "tip", {});
  ASSERT_FALSE(arm.has_value());
  EXPECT_EQ(arm.status().code(), core::ErrorCode::kNotFound);
  EXPECT_THAT(arm.status().message(), HasSubstr("meshes/none.stl' is missing"));
}

}  // namespace
}  // namespace phantom::robot
