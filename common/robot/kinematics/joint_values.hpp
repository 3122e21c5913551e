#pragma once

#include <cmath>

#include "common/core/joints.hpp"
#include "common/robot/kinematics/serial_arm.hpp"

namespace phantom::robot {

inline bool is_prismatic(const Joint& joint) noexcept { return joint.type == JointType::kPrismatic; }

/// Returns an array with one value for all revolute joints and another for all prismatic joints of the arm.
inline core::JointArray by_joint_type(const SerialArm& arm, double revolute, double prismatic) noexcept {
  core::JointArray values{};
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    values[j] = is_prismatic(arm.joints()[j]) ? prismatic : revolute;
  }
  return values;
}

/// How far a reported position may lie beyond a joint's limits, as a share of the joint's range. It admits an
/// arm that was pushed onto its mechanical stops, but no arm that is somewhere else. master_io, slave_io and
/// the phantom refuse positions farther out.
inline constexpr double kLimitMarginShare = 0.05;

/// Returns whether `q` (rad or m) lies within lower … upper, widened by that margin. A joint without limits
/// (infinite ones) accepts every finite `q`. NaN is never accepted. Real-time safe: yes.
inline bool near_limits(double q, double lower, double upper) noexcept {
  const double margin = kLimitMarginShare * (upper - lower);
  return !std::isfinite(margin) ? std::isfinite(q) : q >= lower - margin && q <= upper + margin;
}

}  // namespace phantom::robot
