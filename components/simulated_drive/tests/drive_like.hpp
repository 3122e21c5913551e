#pragma once

#include <numbers>

#include "common/can/arm_drives.hpp"
#include "components/simulated_drive/simulated_drive.hpp"

namespace phantom::simulated_drive {

/// Radians of the drive's output per unit of its joint: 1 of a revolute joint.
inline double rad_per_unit(const can::AxisConfig& axis) {
  return 2.0 * std::numbers::pi / axis.units.travel_per_turn;
}

/// A drive with the motor and gear of `axis`, whose joint has `inertia` (kg·m² or kg), no friction and no
/// limits that matter, and starts at `home` (rad or m).
inline DriveOptions drive_like(const can::AxisConfig& axis, double home, double inertia) {
  DriveOptions o;
  o.node = axis.node;
  o.motor.counts_per_turn = axis.units.counts_per_turn;
  o.motor.gear_ratio = axis.units.gear_ratio;
  o.motor.rated_torque_Nm = axis.units.rated_motor_torque_Nm();
  o.motor.start_rad = home * rad_per_unit(axis);
  o.motor.joint = {inertia / (rad_per_unit(axis) * rad_per_unit(axis)), 0.0, 0.0, -100.0, 100.0};
  return o;
}

}  // namespace phantom::simulated_drive
