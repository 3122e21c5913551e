#include "common/percept/view_node.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <set>
#include <string>

namespace phantom::percept {
namespace {

TEST(ViewNodes, AreTheNodesOfACubeWithAxesAlongW) {
  std::set<std::string> names;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int number = 1; number <= kNodeCount; ++number) {
    const auto node = node_from_number(number);
    ASSERT_TRUE(node);
    const Eigen::Vector3d direction = node_direction(*node);
    EXPECT_NEAR(direction.norm(), 1, 1e-12);
    const double greatest = direction.cwiseAbs().maxCoeff();
    for (const double part : direction) EXPECT_TRUE(part == 0 || std::abs(std::abs(part) - greatest) < 1e-12);
    names.insert(node_name(*node));
    sum += direction;
  }
  EXPECT_EQ(names.size(), 14U);
  EXPECT_NEAR(sum.norm(), 0, 1e-12);
  EXPECT_EQ(node_direction(ViewNode::kNorth), Eigen::Vector3d::UnitY());
  EXPECT_EQ(node_direction(ViewNode::kEast), Eigen::Vector3d::UnitX());
  EXPECT_EQ(node_direction(ViewNode::kTop), Eigen::Vector3d::UnitZ());
  EXPECT_TRUE(node_direction(ViewNode::kAutomatic).isZero());
}

// The document of the topic and the page's help say it in words: 1 to 4 above, counter-clockwise from +x+y.
TEST(ViewNodes, CornersRunCounterClockwiseFromAbove) {
  for (int corner = 1; corner <= 8; ++corner) {
    const Eigen::Vector3d direction = node_direction(*node_from_number(corner));
    EXPECT_EQ(direction.z() > 0, corner <= 4) << corner;
    const double quarter = std::numbers::pi / 2;
    const double expected = quarter / 2 + quarter * ((corner - 1) % 4);
    EXPECT_NEAR(std::remainder(std::atan2(direction.y(), direction.x()) - expected, 4 * quarter), 0, 1e-12)
        << corner;
  }
}

TEST(ViewNodes, OnlyTheirNumbersAndNamesNameThem) {
  for (const double number : {-1.0, 14.5, 15.0, 1e30, std::nan("")})
    EXPECT_FALSE(node_from_number(number)) << number;
  EXPECT_EQ(node_from_number(9.0), ViewNode::kNorth);
  for (int number = 0; number <= kNodeCount; ++number)
    EXPECT_EQ(node_from_name(node_name(static_cast<ViewNode>(number))), static_cast<ViewNode>(number));
  for (const char* name : {"", "n", "9", "0", "NN", "main"}) EXPECT_FALSE(node_from_name(name)) << name;
}

TEST(ViewDirection, TurnsFromXTowardsYAndUp) {
  const double quarter = std::numbers::pi / 2;
  EXPECT_TRUE(direction_at(0, 0).isApprox(Eigen::Vector3d::UnitX(), 1e-12));
  EXPECT_TRUE(direction_at(quarter, 0).isApprox(Eigen::Vector3d::UnitY(), 1e-12));
  EXPECT_TRUE(direction_at(1.0, quarter).isApprox(Eigen::Vector3d::UnitZ(), 1e-12));
}

// Property: always a rotation, its third row what was asked for, its second as far up as can be.
TEST(ViewAxes, AreRightUpAndBackward) {
  for (int k = 0; k < 300; ++k) {
    const Eigen::Vector3d backward = direction_at(0.7 * k, 1.55 * std::sin(1.3 * k));
    const Eigen::Matrix3d axes = view_axes(backward);
    EXPECT_TRUE((axes * axes.transpose()).isIdentity(1e-12)) << k;
    EXPECT_NEAR(axes.determinant(), 1, 1e-12) << k;
    EXPECT_TRUE(axes.row(2).transpose().isApprox(backward, 1e-12)) << k;
    const bool steep = std::abs(backward.z()) > 0.999;
    EXPECT_NEAR(axes(0, steep ? 1 : 2), 0, 1e-12) << k;  // the horizon is level
    EXPECT_GT(axes(1, steep ? 1 : 2), 0) << k;           // and up is up
  }
  const Eigen::Matrix3d from_south = view_axes(-Eigen::Vector3d::UnitY());
  EXPECT_TRUE(from_south.row(0).isApprox(Eigen::RowVector3d::UnitX(), 1e-12));
  const Eigen::Matrix3d from_top = view_axes(Eigen::Vector3d::UnitZ());
  EXPECT_TRUE(from_top.row(0).isApprox(Eigen::RowVector3d::UnitX(), 1e-12));
  EXPECT_TRUE(from_top.row(1).isApprox(Eigen::RowVector3d::UnitY(), 1e-12));
}

}  // namespace
}  // namespace phantom::percept
