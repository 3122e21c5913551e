#pragma once

#include "common/core/joints.hpp"
#include "common/robot/serial_arm.hpp"

namespace phantom::robot {

inline bool is_prismatic(const Joint& joint) noexcept { return joint.type == JointType::kPrismatic; }

/// One value for revolute and one for prismatic joints, spread over the arm. Units as the values'.
inline core::JointArray by_joint_type(const SerialArm& arm, double revolute, double prismatic) noexcept {
  core::JointArray values{};
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    values[j] = is_prismatic(arm.joints()[j]) ? prismatic : revolute;
  }
  return values;
}

}  // namespace phantom::robot
