#pragma once

#include <cstdint>
#include <string>

#include "common/core/status.hpp"

namespace phantom::can {

/// Converts between the units of one axis's drive and joint units. Joint units are rad, rad/s, N·m for a
/// revolute joint and m, m/s, N for a prismatic joint.
struct AxisUnits {
  double counts_per_turn = 0.0;  ///< encoder counts per turn of the motor; > 0
  double gear_ratio = 1.0;       ///< turns of the motor per turn of the gear's output; > 0
  double travel_per_turn =
      6.283185307179586;  ///< joint units per turn of the output: 2π rad, or the lead in m; > 0
  int sign = 1;           ///< −1: the motor turns opposite to the joint
  double offset = 0.0;    ///< joint position at count 0
  // λ, the motor's torque per command (thesis eq. 3.12): of a drive that takes a current ...
  double torque_constant_Nm_per_A = 0.0;  ///< > 0
  double rated_current_A = 0.0;           ///< > 0
  double velocity_counts_per_turn = 0.0;  ///< velocity units of the drive per turn/s; 0: counts_per_turn
  // ... or λ of an amplifier that takes a voltage, as behind an analogue output; both 0: it takes a current.
  double torque_sensitivity_Nm_per_V = 0.0;  ///< > 0
  double rated_voltage_V = 0.0;              ///< at which the motor gives its rated torque; > 0

  bool takes_voltage() const noexcept { return torque_sensitivity_Nm_per_V != 0.0 || rated_voltage_V != 0.0; }

  double counts_per_unit() const noexcept { return sign * counts_per_turn * gear_ratio / travel_per_turn; }
  double velocity_per_unit() const noexcept {
    return counts_per_unit() *
           (velocity_counts_per_turn > 0.0 ? velocity_counts_per_turn / counts_per_turn : 1.0);
  }
  double rated_motor_torque_Nm() const noexcept {
    return takes_voltage() ? torque_sensitivity_Nm_per_V * rated_voltage_V
                           : torque_constant_Nm_per_A * rated_current_A;
  }
  /// Returns N·m (or N) at the joint per mille of rated motor torque, without losses in the gear.
  double torque_per_mille() const noexcept {
    return sign * rated_motor_torque_Nm() * 1e-3 * gear_ratio * 6.283185307179586 / travel_per_turn;
  }

  // Conversion to the drive, clamped to its integers. Values that are not finite give 0. Real-time safe: yes.
  std::int32_t position_counts(double joint) const noexcept;
  std::int32_t velocity_counts(double joint_per_s) const noexcept;
  std::int16_t torque_mille(double joint_torque) const noexcept;
  // Conversion from the drive. Real-time safe: yes.
  double position(std::int32_t counts) const noexcept { return offset + counts / counts_per_unit(); }
  double velocity(std::int32_t counts) const noexcept { return counts / velocity_per_unit(); }
  double torque(std::int16_t mille) const noexcept { return mille * torque_per_mille(); }
};

/// Checks units and joint range. Refuses units that are zero, negative or not finite, and a range that
/// exceeds the drive's 32 bits. The message names `axis`, field, value and what is allowed.
core::Status check_units(const AxisUnits& units, const std::string& axis, double lower, double upper);

}  // namespace phantom::can
