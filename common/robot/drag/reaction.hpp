#pragma once

#include "common/core/joints.hpp"

namespace phantom::robot {

/// What soft bodies answer to an arm that presses into them, joint by joint (thesis 7.3(4)): torque at one
/// pose, and how it falls as the joint moves on.
struct JointReaction {
  core::JointArray torque{};     ///< N·m or N; 0: none
  core::JointArray stiffness{};  ///< N·m/rad or N/m, ≥ 0: −∂torque/∂q
  core::JointArray position{};   ///< rad or m: the pose

  friend bool operator==(const JointReaction&, const JointReaction&) = default;
};

}  // namespace phantom::robot
