// Kinematics against Orocos KDL: forward kinematics and Jacobians of DH tables and of URDF files.
#include <gtest/gtest.h>
#include <urdf_parser/urdf_parser.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <kdl/chain.hpp>
#include <kdl/chainfksolverpos_recursive.hpp>
#include <kdl/chainjnttojacsolver.hpp>
#include <numbers>
#include <random>
#include <sstream>

#include "common/robot/kinematics/jacobian.hpp"
#include "common/robot/tests/foreign_arms.hpp"
#include "common/robot/tests/test_arms.hpp"

namespace phantom::robot {
namespace {

using core::JointArray;

/// The tip frame's pose and Jacobian (linear rows, then angular), ours against KDL's, in random
/// configurations.
void compare(const SerialArm& arm, const std::string& tip, const KDL::Chain& chain, unsigned seed) {
  ASSERT_EQ(chain.getNrOfJoints(), arm.joint_count());
  const auto [link, X_link_tip] = *arm.find_frame(tip);
  KDL::ChainFkSolverPos_recursive forward(chain);
  KDL::ChainJntToJacSolver differential(chain);
  std::mt19937 random(seed);
  for (int trial = 0; trial < 50; ++trial) {
    const JointArray q = test_arms::random_joints(arm, random, std::numbers::pi);
    KDL::JntArray q_kdl(chain.getNrOfJoints());
    for (unsigned i = 0; i < chain.getNrOfJoints(); ++i) q_kdl(i) = q[i];
    KDL::Frame expected;
    KDL::Jacobian jacobian(chain.getNrOfJoints());
    ASSERT_GE(forward.JntToCart(q_kdl, expected), 0);
    ASSERT_GE(differential.JntToJac(q_kdl, jacobian), 0);

    LinkPoses X_WL;
    arm.link_poses(q, X_WL);
    const geometry::Pose actual = X_WL[link] * X_link_tip;
    for (int r = 0; r < 3; ++r) {
      EXPECT_NEAR(actual.translation_m[r], expected.p(r), 1e-12);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(actual.rotation(r, c), expected.M(r, c), 1e-12);
    }
    const Jacobian ours = tool_jacobian(arm, X_WL);
    EXPECT_LT((tool_pose(arm, X_WL).translation_m - actual.translation_m).norm(), 1e-12);
    for (std::size_t j = 0; j < arm.joint_count(); ++j) {
      JointArray unit{};
      unit[j] = 1.0;
      const Eigen::Vector3d linear = arm.point_velocity_W(link, actual.translation_m, X_WL, unit);
      for (int r = 0; r < 6; ++r) {
        const double expected_rate = jacobian(static_cast<unsigned>(r), static_cast<unsigned>(j));
        EXPECT_NEAR(ours(r, static_cast<int>(j)), expected_rate, 1e-12) << "joint " << j;
        if (r < 3) {
          EXPECT_NEAR(linear[r], expected_rate, 1e-12) << "joint " << j;
        }
      }
    }
  }
}

std::vector<DhRow> random_table(std::mt19937& random, std::size_t joints) {
  std::uniform_real_distribution<double> angle(-3.0, 3.0), length(-0.6, 0.6);
  std::vector<DhRow> rows;
  for (std::size_t i = 0; i < joints; ++i) {
    DhRow row;
    row.link = "link_" + std::to_string(i + 1);
    row.type = random() % 3 == 0 ? JointType::kPrismatic : JointType::kRevolute;
    row.theta_rad = angle(random), row.alpha_rad = angle(random);
    row.d_m = length(random), row.a_m = length(random);
    row.lower = -2.0, row.upper = 2.0, row.max_speed = row.max_effort = 1.0;
    rows.push_back(row);
  }
  return rows;
}

KDL::Chain kdl_of(const std::vector<DhRow>& rows, DhConvention convention) {
  KDL::Chain chain;
  for (const DhRow& row : rows) {
    const KDL::Joint joint(row.type == JointType::kRevolute ? KDL::Joint::RotZ : KDL::Joint::TransZ);
    if (convention == DhConvention::kClassic) {
      chain.addSegment(KDL::Segment{joint, KDL::Frame::DH(row.a_m, row.alpha_rad, row.d_m, row.theta_rad)});
    } else {
      chain.addSegment(
          KDL::Segment{KDL::Joint(KDL::Joint::None),
                       KDL::Frame::DH_Craig1989(row.a_m, row.alpha_rad, row.d_m, row.theta_rad)});
      chain.addSegment(KDL::Segment(joint));
    }
  }
  return chain;
}

class DhTable : public testing::TestWithParam<DhConvention> {};

TEST_P(DhTable, AgreesWithKdlOnRandomTables) {
  std::mt19937 random(1);
  for (std::size_t joints = 1; joints <= core::kMaxJoints; ++joints) {
    const auto rows = random_table(random, joints);
    const auto arm = SerialArm::from_dh(rows, GetParam(), {});
    ASSERT_TRUE(arm) << arm.status().message();
    compare(*arm, rows.back().link, kdl_of(rows, GetParam()), static_cast<unsigned>(joints));
  }
}

/// Every row's own frame, not the last one's alone: what a skin is attached to.
TEST_P(DhTable, EveryRowsFrameAgreesWithKdl) {
  std::mt19937 random(2);
  const auto rows = random_table(random, 6);
  const auto whole = SerialArm::from_dh(rows, GetParam(), {});
  for (std::size_t n = 1; n <= rows.size(); ++n) {
    const std::vector<DhRow> part(rows.begin(), rows.begin() + static_cast<std::ptrdiff_t>(n));
    const auto arm = SerialArm::from_dh(part, GetParam(), {});
    compare(*arm, part.back().link, kdl_of(part, GetParam()), 3);
    LinkPoses X_part, X_whole;
    const JointArray q = test_arms::random_joints(*whole, random, std::numbers::pi);
    arm->link_poses(q, X_part);
    whole->link_poses(q, X_whole);
    const auto [link, X_link_row] = *whole->find_frame(part.back().link);
    EXPECT_TRUE(
        (X_whole[link] * X_link_row).translation_m.isApprox((X_part[n] * X_link_row).translation_m, 1e-12));
    // The axis of a link ends where its row's frame (classic) stands.
    if (GetParam() == DhConvention::kClassic) {
      EXPECT_TRUE(arm->link_axis_m(n).second.isApprox(X_link_row.translation_m, 1e-12));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Conventions, DhTable,
                         testing::Values(DhConvention::kClassic, DhConvention::kModified),
                         [](const auto& convention) {
                           return convention.param == DhConvention::kClassic ? "Classic" : "Modified";
                         });

KDL::Frame kdl_of(const urdf::Pose& pose) {
  return {KDL::Rotation::Quaternion(pose.rotation.x, pose.rotation.y, pose.rotation.z, pose.rotation.w),
          KDL::Vector(pose.position.x, pose.position.y, pose.position.z)};
}

/// The chain of a URDF file as KDL wants it: a joint's axis and origin in the frame of the segment before.
KDL::Chain kdl_of_urdf(const std::filesystem::path& file, const std::string& tip) {
  std::stringstream text;
  text << std::ifstream(file).rdbuf();
  const auto model = urdf::parseURDF(text.str());
  std::vector<urdf::JointSharedPtr> joints;
  for (auto link = model->getLink(tip); link->parent_joint; link = link->getParent())
    joints.push_back(link->parent_joint);
  std::reverse(joints.begin(), joints.end());
  KDL::Chain chain;
  for (const auto& joint : joints) {
    const KDL::Frame origin = kdl_of(joint->parent_to_joint_origin_transform);
    const KDL::Vector axis = origin.M * KDL::Vector(joint->axis.x, joint->axis.y, joint->axis.z);
    const auto type = joint->type == urdf::Joint::FIXED       ? KDL::Joint::None
                      : joint->type == urdf::Joint::PRISMATIC ? KDL::Joint::TransAxis
                                                              : KDL::Joint::RotAxis;
    if (type == KDL::Joint::None) {
      chain.addSegment(KDL::Segment{KDL::Joint(KDL::Joint::None), origin});
    } else {
      chain.addSegment(KDL::Segment{KDL::Joint(origin.p, axis, type), origin});
    }
  }
  return chain;
}

TEST(Urdf, ForeignArmsAgreeWithKdl) {
  for (const auto& foreign : foreign_arms::all()) {
    SCOPED_TRACE(foreign.name);
    const auto file = test_arms::write_urdf(foreign.body);
    const auto arm = SerialArm::from_urdf(file, foreign.tip, {});
    ASSERT_TRUE(arm) << arm.status().message();
    compare(*arm, foreign.tip, kdl_of_urdf(file, foreign.tip), 4);
  }
}

TEST(Urdf, TheShippedArmAgreesWithKdl) {
  const auto file =
      std::filesystem::path(PHANTOM_SOURCE_DIR) / "deploy/cells/hot_cell/arm/suspended_arm.urdf";
  const auto arm = SerialArm::from_urdf(file, "tool", {});
  ASSERT_TRUE(arm) << arm.status().message();
  compare(*arm, "tool", kdl_of_urdf(file, "tool"), 5);
}

// ---- what is refused

std::string table_refusal(std::vector<DhRow> rows) {
  const auto arm = SerialArm::from_dh(rows, DhConvention::kClassic, {});
  EXPECT_FALSE(arm.has_value());
  return arm.has_value() ? "" : arm.status().message();
}

TEST(DhTableRefuses, WhatCannotBeAnArm) {
  std::mt19937 random(6);
  const auto good = random_table(random, 2);
  EXPECT_EQ(table_refusal({}), "DH table: has 0 rows; allowed: 1 to 16");
  EXPECT_EQ(table_refusal(random_table(random, 17)), "DH table: has 17 rows; allowed: 1 to 16");
  auto rows = good;
  rows[1].alpha_rad = std::nan("");
  EXPECT_EQ(table_refusal(rows), "DH table: row 2: theta, d, a and alpha must be finite numbers");
  rows = good;
  rows[0].lower = 3.0;
  EXPECT_EQ(table_refusal(rows), "DH table: row 1: limit lower 3.000000 must be less than upper 2.000000");
  rows = good;
  rows[1].max_speed = 0.0;
  EXPECT_EQ(table_refusal(rows), "DH table: row 2: max_speed: 0.000000; allowed: above 0");
  rows = good;
  rows[1].link = rows[0].link;
  EXPECT_EQ(table_refusal(rows), "DH table: row 2: link 'link_1' stands twice");
  rows = good;
  rows[0].link = "base";
  EXPECT_EQ(table_refusal(rows), "DH table: row 1: link: 'base'; allowed: a name other than 'base'");
}

}  // namespace
}  // namespace phantom::robot
