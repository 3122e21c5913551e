#pragma once

#include <array>
#include <cstddef>

#include "common/core/joints.hpp"

namespace phantom::teleop {

/// A joint of the master and the arm's joint that it leads: q_arm = at_zero + ratio · q_master.
struct LedJoint {
  std::size_t arm_joint = 0;  ///< index of the arm's joint
  double ratio = 1.0;         ///< not 0; rad or m of the arm's joint per rad or m of the master's
  double at_zero = 0.0;       ///< rad or m: the arm's joint where the master's is at 0
};

/// Which joints of the arm a master of fewer joints leads. No two lead the same one.
struct JointMappingParameters {
  std::size_t master_joints = 0;               ///< at most arm_joints
  std::size_t arm_joints = 0;                  ///< at most core::kMaxJoints
  std::array<LedJoint, core::kMaxJoints> led;  ///< by joint of the master
};

/// Maps the joints of a master onto some of the arm's joints (as a simple transmission): positions and
/// velocities by the ratio, and torques back by the same ratio, its transpose. So the power of a torque on
/// the arm's joints is that of its image at the master's, at every tick: what only takes energy there only
/// takes energy here. Joints that are not led have no velocity, and nothing of their torque comes back. Pure.
/// Real-time safe: yes.
class JointMapping {
 public:
  explicit JointMapping(const JointMappingParameters& parameters) noexcept;

  std::size_t master_joints() const noexcept { return parameters_.master_joints; }
  const LedJoint& led(std::size_t master_joint) const noexcept { return parameters_.led[master_joint]; }
  bool leads(std::size_t arm_joint) const noexcept { return is_led_[arm_joint]; }

  /// Returns the arm's pose at the master's `q_master`; joints that are not led stand as in `others`.
  core::JointArray arm_position(const core::JointArray& q_master,
                                const core::JointArray& others) const noexcept;
  core::JointArray arm_velocity(const core::JointArray& v_master) const noexcept;
  /// Returns the master's position at which the joints that it leads stand as in `q_arm`.
  core::JointArray master_position(const core::JointArray& q_arm) const noexcept;
  /// Returns the torques (N·m or N) on the master's joints of `torque` on the arm's.
  core::JointArray master_torque(const core::JointArray& torque) const noexcept;
  /// Sets the values of joints that are not led to 0.
  void keep_led(core::JointArray& values) const noexcept;

 private:
  JointMappingParameters parameters_;
  std::array<bool, core::kMaxJoints> is_led_{};
};

}  // namespace phantom::teleop
