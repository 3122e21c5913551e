#include "common/teleop/coupling/joint_mapping.hpp"

namespace phantom::teleop {

JointMapping::JointMapping(const JointMappingParameters& parameters) noexcept : parameters_(parameters) {
  for (std::size_t m = 0; m < parameters_.master_joints; ++m) is_led_[parameters_.led[m].arm_joint] = true;
}

core::JointArray JointMapping::arm_position(const core::JointArray& q_master,
                                            const core::JointArray& others) const noexcept {
  core::JointArray q = others;
  for (std::size_t m = 0; m < parameters_.master_joints; ++m) {
    const LedJoint& led = parameters_.led[m];
    q[led.arm_joint] = led.at_zero + led.ratio * q_master[m];
  }
  return q;
}

core::JointArray JointMapping::arm_velocity(const core::JointArray& v_master) const noexcept {
  core::JointArray v{};
  for (std::size_t m = 0; m < parameters_.master_joints; ++m)
    v[parameters_.led[m].arm_joint] = parameters_.led[m].ratio * v_master[m];
  return v;
}

core::JointArray JointMapping::master_position(const core::JointArray& q_arm) const noexcept {
  core::JointArray q{};
  for (std::size_t m = 0; m < parameters_.master_joints; ++m) {
    const LedJoint& led = parameters_.led[m];
    q[m] = (q_arm[led.arm_joint] - led.at_zero) / led.ratio;
  }
  return q;
}

core::JointArray JointMapping::master_torque(const core::JointArray& torque) const noexcept {
  core::JointArray at_master{};
  for (std::size_t m = 0; m < parameters_.master_joints; ++m)
    at_master[m] = parameters_.led[m].ratio * torque[parameters_.led[m].arm_joint];
  return at_master;
}

void JointMapping::keep_led(core::JointArray& values) const noexcept {
  for (std::size_t j = 0; j < values.size(); ++j) {
    if (!is_led_[j]) values[j] = 0.0;
  }
}

}  // namespace phantom::teleop
