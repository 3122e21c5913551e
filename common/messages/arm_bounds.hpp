#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "common/core/joints.hpp"
#include "common/robot/kinematics/serial_arm.hpp"
#include "common/teleop/rendering/feedback_rendering.hpp"

namespace phantom::messages {

/// The arm that a receiver expects its samples to describe. Samples of another arm are refused.
struct ArmBounds {
  std::size_t joint_count = 0;  ///< 0: no arm is known, and samples of any arm are accepted
  std::size_t link_count = 0;   ///< base included; 0: any
  /// Joint limits, at first infinite. Positions farther outside than robot::near_limits allows are refused.
  core::JointArray lower = teleop::everywhere(-std::numeric_limits<double>::infinity());
  core::JointArray upper = teleop::everywhere(std::numeric_limits<double>::infinity());
  std::vector<std::string> joint_names;  ///< for messages; may be empty
};

inline ArmBounds bounds_of(const robot::SerialArm& arm) {
  ArmBounds bounds;
  bounds.joint_count = arm.joint_count();
  bounds.link_count = arm.links().size();
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    bounds.lower[j] = arm.joints()[j].lower;
    bounds.upper[j] = arm.joints()[j].upper;
    bounds.joint_names.push_back(arm.joints()[j].name);
  }
  return bounds;
}

}  // namespace phantom::messages
