#include "components/simulated_drive/motor.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::simulated_drive {
namespace {

constexpr double kVelocityBandwidth_rad_s = 250.0;
constexpr double kPositionBandwidth_rad_s = 60.0;
constexpr double kIntegralPerSecond = 40.0;

}  // namespace

double Motor::hand_torque_Nm() const {
  const HandParameters& hand = parameters_.hand;
  if (hand.swing_rad == 0.0) return 0.0;
  const double rate_rad_s = 2.0 * 3.14159265358979323846 / hand.period_s;
  const double where_rad = parameters_.start_rad + hand.swing_rad * std::sin(rate_rad_s * time_s_);
  const double speed_rad_s = hand.swing_rad * rate_rad_s * std::cos(rate_rad_s * time_s_);
  return hand.stiffness_Nm_per_rad * (where_rad - q_rad_) +
         hand.damping_Nms_per_rad * (speed_rad_s - v_rad_s_);
}

double Motor::wall_torque_Nm() const {
  const WallParameters& wall = parameters_.wall;
  const double into = wall.at_rad > parameters_.start_rad ? 1.0 : -1.0;
  const double depth_rad = into * (q_rad_ - wall.at_rad);
  if (wall.stiffness_Nm_per_rad == 0.0 || depth_rad <= 0.0) return 0.0;
  return -into *
         std::max(0.0, wall.stiffness_Nm_per_rad * depth_rad + wall.damping_Nms_per_rad * into * v_rad_s_);
}

void Motor::move_brake(double dt_s) {
  const BrakeParameters& brake = parameters_.brake;
  brake_moves_s_ = coil_ == closed_ ? brake_moves_s_ + dt_s : 0.0;
  if (brake_moves_s_ < (closed_ ? brake.release_s : brake.engage_s)) return;
  closed_ = !coil_;
}

void Motor::step(double mille, double dt_s) {
  time_s_ += dt_s;
  const double torque_Nm = mille * 1e-3 * parameters_.rated_torque_Nm * parameters_.gear_ratio +
                           parameters_.load_Nm + hand_torque_Nm() + wall_torque_Nm();
  move_brake(dt_s);
  simulation::JointMechanics joint = parameters_.joint;
  if (brake_is_closed()) joint.coulomb += parameters_.brake.holds_Nm;
  simulation::integrate(joint, torque_Nm, dt_s, q_rad_, v_rad_s_);
}

std::int64_t Motor::counts() const {
  return std::llround(std::floor(q_rad_ * parameters_.counts_per_rad() + 0.5));
}

double Motor::counts_per_s() const { return v_rad_s_ * parameters_.counts_per_rad(); }

double Motor::mille_per_acceleration() const {
  const double torque_per_mille = 1e-3 * parameters_.rated_torque_Nm * parameters_.gear_ratio;
  return parameters_.joint.inertia / torque_per_mille / parameters_.counts_per_rad();
}

double MotionLoops::step(const MotionDemand& demand, double limit_mille, double dt_s) {
  double mille = 0.0;
  if (demand.kind == MotionDemand::Kind::kOff) integral_mille_ = 0.0;
  if (demand.kind == MotionDemand::Kind::kTorque) mille = demand.offset_mille;
  if (demand.kind == MotionDemand::Kind::kPosition || demand.kind == MotionDemand::Kind::kVelocity) {
    double velocity = demand.velocity;
    if (demand.kind == MotionDemand::Kind::kPosition)
      velocity += kPositionBandwidth_rad_s * (demand.position - static_cast<double>(motor_.counts()));
    const double gain = kVelocityBandwidth_rad_s * motor_.mille_per_acceleration();
    const double error = velocity - motor_.counts_per_s();
    integral_mille_ =
        std::clamp(integral_mille_ + kIntegralPerSecond * gain * error * dt_s, -limit_mille, limit_mille);
    mille = demand.offset_mille + gain * error + integral_mille_;
  }
  mille = std::clamp(mille, -limit_mille, limit_mille);
  motor_.step(mille, dt_s);
  return mille;
}

}  // namespace phantom::simulated_drive
