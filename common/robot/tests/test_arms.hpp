#pragma once
// Arms for tests, written as URDF files into the test's temporary folder.

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <stdexcept>
#include <string>

#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::robot::test_arms {

/// Writes <robot>body</robot> to a fresh file and returns its path.
inline std::filesystem::path write_urdf(const std::string& body) {
  static int number = 0;
  const std::filesystem::path file =
      std::filesystem::path(testing::TempDir()) /
      ("arm_" + std::to_string(getpid()) + "_" + std::to_string(++number) + ".urdf");
  std::ofstream(file) << "<?xml version=\"1.0\"?>\n<robot name=\"arm\">" << body << "</robot>\n";
  return file;
}

/// A base that is not turned.
inline geometry::Pose at(double x_m, double y_m, double z_m) {
  return {Eigen::Matrix3d::Identity(), {x_m, y_m, z_m}};
}

inline SerialArm load(const std::string& body, const std::string& tip, const geometry::Pose& X_WB = {}) {
  auto arm = SerialArm::from_urdf(write_urdf(body), tip, X_WB);
  if (!arm) throw std::runtime_error(arm.status().message());
  return *std::move(arm);
}

inline std::string moving_joint(const std::string& name, const std::string& type, const std::string& parent,
                                const std::string& child, const std::string& xyz, const std::string& rpy,
                                const std::string& axis, double limit) {
  return "<joint name=\"" + name + "\" type=\"" + type + "\"><parent link=\"" + parent +
         "\"/><child link=\"" + child + "\"/><origin xyz=\"" + xyz + "\" rpy=\"" + rpy + "\"/><axis xyz=\"" +
         axis + "\"/><limit lower=\"" + std::to_string(-limit) + "\" upper=\"" + std::to_string(limit) +
         "\" velocity=\"2\" effort=\"50\"/></joint>";
}

inline std::string link(const std::string& name, double mass_kg, const std::string& centre) {
  return "<link name=\"" + name + "\"><inertial><origin xyz=\"" + centre + "\"/><mass value=\"" +
         std::to_string(mass_kg) +
         "\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" iyz=\"0\" izz=\"1\"/></inertial></link>";
}

/// Two revolute joints about z; links of 0.4 m and 0.3 m along x.
inline SerialArm planar(const geometry::Pose& X_WB = {}) {
  return load(
      link("base", 0, "0 0 0") + link("upper", 1, "0.2 0 0") + link("lower", 1, "0.15 0 0") +
          link("tip", 0, "0 0 0") +
          moving_joint("j1", "revolute", "base", "upper", "0 0 0", "0 0 0", "0 0 1", 3) +
          moving_joint("j2", "revolute", "upper", "lower", "0.4 0 0", "0 0 0", "0 0 1", 3) +
          R"(<joint name="end" type="fixed"><parent link="lower"/><child link="tip"/><origin xyz="0.3 0 0"/></joint>)",
      "tip", X_WB);
}

/// Seven joints hanging from a gantry, with slanted origins and axes so that nothing is zero by luck.
inline SerialArm suspended(const geometry::Pose& X_WB = {{geometry::rotation_from_rpy(0.1, -0.2, 0.3)},
                                                         {0.05, -0.1, 1.5}}) {
  return load(link("base", 0, "0 0 0") + link("l1", 8, "0 0 0.05") + link("l2", 4, "0.01 0 -0.1") +
                  link("l3", 3, "0 0.02 -0.2") + link("l4", 2, "0.01 0 -0.15") + link("l5", 1, "0 0 -0.05") +
                  link("l6", 0.5, "0 0.01 -0.05") + link("l7", 0.3, "0.02 0 -0.05") +
                  moving_joint("j1", "prismatic", "base", "l1", "0 0 0", "0 0 0", "1 0 0", 0.45) +
                  moving_joint("j2", "revolute", "l1", "l2", "0 0 -0.1", "0 0 0.1", "0 0 1", 3) +
                  moving_joint("j3", "revolute", "l2", "l3", "0 0.05 -0.2", "0.2 0 0", "0 1 0", 1.5) +
                  moving_joint("j4", "revolute", "l3", "l4", "0.02 0 -0.45", "0 0 0", "0 1 0.1", 2) +
                  moving_joint("j5", "revolute", "l4", "l5", "0 0 -0.3", "0 0.1 0", "0 0 1", 3) +
                  moving_joint("j6", "revolute", "l5", "l6", "0 0 -0.1", "0 0 0.3", "1 1 0", 2) +
                  moving_joint("j7", "revolute", "l6", "l7", "0 0 -0.1", "0 0 0", "0 0 1", 3),
              "l7", X_WB);
}

/// A pose anywhere within the joints' limits, and within ±`most` where that is less.
inline core::JointArray random_joints(const SerialArm& arm, std::mt19937& random,
                                      double most = std::numeric_limits<double>::infinity()) {
  core::JointArray q{};
  for (std::size_t i = 0; i < arm.joint_count(); ++i) {
    const Joint& joint = arm.joints()[i];
    q[i] = std::uniform_real_distribution(std::max(-most, joint.lower), std::min(most, joint.upper))(random);
  }
  return q;
}

}  // namespace phantom::robot::test_arms
