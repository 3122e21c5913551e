#pragma once

#include "common/simulation/joint_mechanics.hpp"

namespace phantom::simulation {

struct GripperPlantParameters {
  double widest_m = 0.1;
  double finger_mass_kg = 0.2;    ///< of each finger, with its share of the drive; > 0
  double coulomb_N = 1.0;         ///< friction of each finger
  double viscous_Ns_per_m = 5.0;  ///< at the width
  double object_width_m = 0.0;    ///< of what is between the fingers; 0: nothing
  double object_stiffness_N_per_m = 20'000.0;
  double object_damping_Ns_per_m = 20.0;
};

/// Simulates a parallel gripper: two fingers that a drive moves against each other, and an object between
/// them.
///
/// The width w is the only coordinate. Each finger moves by half of it, so that w has half a finger's mass,
/// and the force on w is that on each finger. The object is a spring and a damper between two faces that are
/// object_width_m apart; it never pulls. The drive is a position loop whose force is limited.
class GripperPlant {
 public:
  static constexpr double kSubStep_s = 0.00025;
  static constexpr double kBandwidth_rad_s = 800.0;  ///< of the drive's position loop, critically damped

  GripperPlant(const GripperPlantParameters& parameters, double start_width_m) noexcept;

  /// Advances by `dt_s` under the demanded width and the drive's greatest force. `contact_N`: of what else
  /// the fingers touch, on the width; > 0 opens. Values that are not finite give no force. Real-time safe:
  /// yes.
  void step(double demand_m, double greatest_force_N, double dt_s, double contact_N = 0.0) noexcept;

  const GripperPlantParameters& parameters() const noexcept { return parameters_; }
  double width_m() const noexcept { return width_m_; }
  double velocity_m_s() const noexcept { return velocity_m_s_; }      ///< > 0: opens
  double drive_force_N() const noexcept { return -drive_N_; }         ///< on each finger, > 0: closes
  double object_force_N() const noexcept { return object_force_N_; }  ///< on each of the object's faces
  /// Force per width by which the drive follows its demand, N/m.
  double drive_stiffness_N_per_m() const noexcept {
    return mechanics_.inertia * kBandwidth_rad_s * kBandwidth_rad_s;
  }

 private:
  GripperPlantParameters parameters_;
  JointMechanics mechanics_;
  double width_m_, velocity_m_s_ = 0.0;
  double drive_N_ = 0.0;  // on the width, > 0: opens
  double object_force_N_ = 0.0;
};

}  // namespace phantom::simulation
