#pragma once

#include <string>

#include "common/teleop/coupling/joint_servo.hpp"

namespace phantom::runtime {

/// Returns why the position loop of a joint of `inertia` > 0 (kg·m²; kg for a prismatic joint) oscillates:
/// its torque acts `delay_periods` of `period_s` after the measured position, more than half of the loop's
/// delay margin (teleop::delay_margin_s). The text continues the phrase "makes j2_yaw " and says what is
/// allowed. Returns an empty string if the delay is acceptable. Returns it also without k_v: friction, which
/// no configuration contains, then has to damp the loop.
std::string oscillation_reason(const teleop::JointServoGains& gains, double inertia, double period_s,
                               double delay_periods);

}  // namespace phantom::runtime
