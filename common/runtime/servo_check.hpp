#pragma once

#include <string>

#include "common/teleop/joint_servo.hpp"

namespace phantom::runtime {

/// Why a position loop on a joint of `inertia` > 0 (kg·m²; kg where it slides) does not come to rest soon:
/// its torque acts `delay_periods` of `period_s` after the position that it answers, more than half of what
/// makes it swing by itself (teleop::delay_margin_s). Words that go on after "makes j2_yaw ", with what is
/// allowed; empty where the loop bears it, and without k_v, for damping is then left to friction, which no
/// configuration knows.
std::string why_it_swings(const teleop::JointServoGains& gains, double inertia, double period_s,
                          double delay_periods);

}  // namespace phantom::runtime
