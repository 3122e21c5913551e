#pragma once

#include <cstdint>

#include "common/simulation/joint_mechanics.hpp"

namespace phantom::simulated_drive {

/// The motor moves in steps of this length.
inline constexpr double kSubStep_s = 0.00025;

/// A person's compliant hand on the joint of a master arm. It swings about the joint's initial position.
struct HandParameters {
  double swing_rad = 0.0;  ///< 0: no hand
  double period_s = 12.0;
  double stiffness_Nm_per_rad = 50.0;
  double damping_Nms_per_rad = 2.5;
};

/// A wall that the joint meets: a spring and a damper that push it back, and never pull.
struct WallParameters {
  double at_rad = 0.0;
  double stiffness_Nm_per_rad = 0.0;  ///< 0: no wall
  double damping_Nms_per_rad = 0.0;
};

/// A holding brake on the joint: a spring closes it, a coil opens it.
struct BrakeParameters {
  double holds_Nm = 0.0;    ///< friction of the closed brake; 0: no brake
  double release_s = 0.05;  ///< from the coil's current until it is open
  double engage_s = 0.05;   ///< from the end of the current until it holds
};

/// Parameters of the motor, its gear and encoder, and the joint that it drives.
struct MotorParameters {
  double counts_per_turn = 65536;  ///< encoder, per turn of the motor
  double gear_ratio = 5.0;         ///< motor turns per turn of the joint
  double rated_torque_Nm = 1.0;    ///< of the motor
  double peak_share = 3.0;         ///< greatest torque ÷ rated torque
  double load_Nm = 0.0;            ///< constant torque on the joint, like that of a weight
  HandParameters hand;
  WallParameters wall;  ///< met from the side of start_rad
  BrakeParameters brake;
  simulation::JointMechanics joint{
      .inertia = 0.5, .viscous = 0.2, .coulomb = 0.05, .lower = -10, .upper = 10};
  double start_rad = 0.0;  ///< joint angle at power-up; count 0 is joint angle 0

  double counts_per_rad() const { return counts_per_turn * gear_ratio / 6.283185307179586; }
};

/// Simulates the motor with its joint, and the encoder's counts.
class Motor {
 public:
  explicit Motor(const MotorParameters& parameters) : parameters_(parameters), q_rad_(parameters.start_rad) {}

  /// Advances by dt_s. `mille`: torque of the motor, per mille of the rated torque.
  void step(double mille, double dt_s);
  /// Switches the current of the brake's coil, which opens it.
  void set_brake_coil(bool on) { coil_ = on; }
  bool brake_is_closed() const { return closed_ && parameters_.brake.holds_Nm > 0.0; }
  std::int64_t counts() const;
  double counts_per_s() const;
  double joint_rad() const { return q_rad_; }
  double joint_rad_s() const { return v_rad_s_; }
  double wall_torque_Nm() const;  ///< that the wall exerts on the joint now
  /// Returns the torque per mille that accelerates the joint by one count/s².
  double mille_per_acceleration() const;
  const MotorParameters& parameters() const { return parameters_; }

 private:
  double hand_torque_Nm() const;
  void move_brake(double dt_s);
  MotorParameters parameters_;
  double q_rad_ = 0.0, v_rad_s_ = 0.0, time_s_ = 0.0;
  double brake_moves_s_ = 0.0;  // for how long the coil has asked for the other state
  bool coil_ = false, closed_ = true;
};

/// Input of the inner control loops.
struct MotionDemand {
  enum class Kind { kOff, kPosition, kVelocity, kTorque };
  Kind kind = Kind::kOff;
  double position = 0.0;      ///< counts
  double velocity = 0.0;      ///< counts/s, target or feed-forward
  double offset_mille = 0.0;  ///< torque offset, or the target in kTorque
};

/// Cascaded position, velocity and torque loops of a servo drive.
class MotionLoops {
 public:
  explicit MotionLoops(const MotorParameters& parameters) : motor_(parameters) {}
  /// Returns the exerted torque, per mille of the rated torque, within ±`limit_mille`.
  double step(const MotionDemand& demand, double limit_mille, double dt_s);
  void reset() { integral_mille_ = 0.0; }
  const Motor& motor() const { return motor_; }
  void set_brake_coil(bool on) { motor_.set_brake_coil(on); }

 private:
  Motor motor_;
  double integral_mille_ = 0.0;
};

}  // namespace phantom::simulated_drive
