#pragma once

#include <cstddef>

#include "common/core/joints.hpp"
#include "common/simulation/encoder.hpp"
#include "common/simulation/joint_mechanics.hpp"

namespace phantom::simulation {

struct MasterPlantParameters {
  std::size_t joint_count = 0;
  ArmMechanics joints{};
  core::JointArray torque_limit_Nm{};     ///< limit of the device's motors
  core::JointArray encoder_resolution{};  ///< rad or m per count
  double velocity_filter_s = 0.002;
};

/// Simulates the master device, a replica of the slave, so that its joints have the slave's coordinates. Hand
/// and motors act on the same joints. The motor torque of one tick acts in the next (one sample of delay, as
/// with a bus). The device's weight is balanced.
class MasterPlant {
 public:
  MasterPlant(const MasterPlantParameters& parameters, const core::JointArray& start_q);

  /// Advances by dt_s. `hand_Nm` acts at once, `motor_Nm` in the next step, within the device's limit.
  /// Torques that are not finite count as zero. Real-time safe: yes.
  void step(const core::JointArray& hand_Nm, const core::JointArray& motor_Nm, double dt_s) noexcept;

  /// The hand feels the true values; the controller gets the encoders' values.
  const core::JointArray& true_position() const noexcept { return q_; }
  const core::JointArray& true_velocity() const noexcept { return v_; }
  const core::JointArray& position() const noexcept { return encoders_.position(); }
  const core::JointArray& velocity() const noexcept { return encoders_.velocity(); }

 private:
  MasterPlantParameters parameters_;
  Encoders encoders_;
  core::JointArray q_, v_{}, pending_Nm_{};
};

}  // namespace phantom::simulation
