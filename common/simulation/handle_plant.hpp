#pragma once

#include "common/geometry/pose.hpp"
#include "common/robot/kinematics/jacobian.hpp"
#include "common/simulation/encoder.hpp"
#include "common/simulation/joint_mechanics.hpp"

namespace phantom::simulation {

struct HandlePlantParameters {
  JointMechanics moved{.inertia =
                           1.0};  ///< along each axis of the device: kg, N·s/m, N; workspace ± upper, m
  JointMechanics turned{.inertia = 0.02};  ///< about each axis: kg·m², N·m·s/rad, N·m; ± upper, rad, in all
  double force_limit_N = 0.0, moment_limit_N_m = 0.0;  ///< of the motors, by axis
  double encoder_step_m = 1e-5, encoder_step_rad = 1e-5;
  double velocity_filter_s = 0.002;
};

/// Simulates a haptic device of six axes whose handle moves freely in its workspace, with inertia and
/// friction.
///
/// The motors' wrench of one tick acts in the next (one sample of delay, as with a bus). The handle's weight
/// is balanced. All values are in the device's axes; moments and rotations are about the handle's origin.
class HandlePlant {
 public:
  explicit HandlePlant(const HandlePlantParameters& parameters);

  /// Advances by dt_s. `hand` acts at once, `motors` in the next step, within the device's limits. A wrench
  /// with a number that is none counts as zero. Real-time safe: yes.
  void step(const robot::Spatial& hand, const robot::Spatial& motors, double dt_s) noexcept;

  const geometry::Pose& pose() const noexcept { return pose_; }       ///< true
  const robot::Spatial& true_twist() const noexcept { return v_; }    ///< as a hand feels it
  robot::Spatial twist() const noexcept;                              ///< as the encoders give it
  const robot::Spatial& motors() const noexcept { return pending_; }  ///< what acts in the next step

 private:
  HandlePlantParameters parameters_;
  Encoders encoders_;
  geometry::Pose pose_;
  robot::Spatial v_ = robot::Spatial::Zero(), pending_ = robot::Spatial::Zero();
  core::JointArray travelled_{};  // of the six axes, for the encoders
};

}  // namespace phantom::simulation
