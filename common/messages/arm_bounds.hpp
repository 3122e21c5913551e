#pragma once

#include <cstddef>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "common/core/joints.hpp"
#include "common/robot/kinematics/model_identity.hpp"
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
  /// Of arm and cell; null: nothing is compared with what writers announce of theirs.
  std::shared_ptr<const robot::ModelIdentity> identity;
};

/// `identity`: of the arm, with what is known of its files and its cell.
inline ArmBounds bounds_of(const robot::SerialArm& arm, const robot::ModelIdentity& identity) {
  ArmBounds bounds;
  bounds.identity = std::make_shared<const robot::ModelIdentity>(identity);
  bounds.joint_count = arm.joint_count();
  bounds.link_count = arm.links().size();
  for (std::size_t j = 0; j < arm.joint_count(); ++j) {
    bounds.lower[j] = arm.joints()[j].lower;
    bounds.upper[j] = arm.joints()[j].upper;
    bounds.joint_names.push_back(arm.joints()[j].name);
  }
  return bounds;
}
inline ArmBounds bounds_of(const robot::SerialArm& arm) { return bounds_of(arm, robot::identify(arm)); }

}  // namespace phantom::messages
