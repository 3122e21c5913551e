#pragma once

#include <cmath>

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

/// How far a reported position may lie beyond a joint's limits, as a share of its range: an arm that was
/// pushed onto its stops, never one that is somewhere else. master_io, slave_io and the phantom refuse what
/// is farther.
inline constexpr double kLimitMarginShare = 0.05;

/// Whether `q` (rad or m) lies within lower … upper and that margin. A joint without limits (infinite ones)
/// may be anywhere; a `q` that is no number is nowhere. Real-time safe: yes.
inline bool near_limits(double q, double lower, double upper) noexcept {
  const double margin = kLimitMarginShare * (upper - lower);
  return !std::isfinite(margin) ? std::isfinite(q) : q >= lower - margin && q <= upper + margin;
}

}  // namespace phantom::robot
