#include "common/teleop/guards/momentum_observer.hpp"

#include <algorithm>
#include <cmath>

#include "common/robot/kinematics/arm_dynamics.hpp"

namespace phantom::teleop {

void MomentumObserver::restart() noexcept {
  residual_Nm_ = {};
  started_ = false;
  age_s_ = 0.0;
  contact_ = {};
  external_ = {};
}

// r(k) = K_I·(p(k) − I(k)) with I(k) = I(k−1) + dt·(known(k) + r(k)), solved for r(k): implicit, so that it
// is stable for any dt, and without an integral that could drift. A drive reports the torque that it exerted
// up to its sample.
void MomentumObserver::follow(const core::JointArray& momentum, const core::JointArray& known_Nm,
                              double dt_s) noexcept {
  for (std::size_t j = 0; j < arm_.joint_count(); ++j) {
    const double gained = momentum[j] - momentum_[j] - dt_s * known_Nm[j];
    residual_Nm_[j] = (parameters_.lag_s * residual_Nm_[j] + gained) / (parameters_.lag_s + dt_s);
  }
}

double MomentumObserver::greatest_share() const noexcept {
  double greatest = 0.0;
  for (std::size_t j = 0; j < arm_.joint_count(); ++j)
    greatest = std::max(greatest, std::abs(residual_Nm_[j]) / parameters_.threshold_Nm[j]);
  return greatest;
}

const ExternalTorque& MomentumObserver::step(const robot::LinkPoses& X_WL, const DriveMotion& motion,
                                             double dt_s, const robot::Payload& payload) noexcept {
  const std::size_t count = arm_.joint_count();
  const bool reloaded = !(payload == payload_);
  payload_ = payload;
  robot::ArmMomentum now;
  core::JointArray known_Nm{};
  if (parameters_.coupled) {
    now = robot::momentum_of(arm_, parameters_.inertia_kg_m2, X_WL, motion.velocity, payload_);
  } else {
    for (std::size_t j = 0; j < count; ++j)
      now.momentum[j] = parameters_.inertia_kg_m2[j] * motion.velocity[j];
  }
  core::JointArray weight_Nm = parameters_.weight ? arm_.gravity_torque(X_WL) : core::JointArray{};
  robot::add_weight(arm_, payload_, X_WL, weight_Nm);
  if (buoyancy_ != nullptr) {
    buoyancy_->add_lift(arm_, X_WL, weight_Nm);
    buoyancy_->add_lift(arm_, payload_, X_WL, weight_Nm);
  }
  for (std::size_t j = 0; j < count; ++j) {
    const double v = motion.velocity[j];
    const double friction_Nm =
        parameters_.coulomb_Nm[j] * std::clamp(v / parameters_.slow_rad_s[j], -1.0, 1.0) +
        parameters_.viscous_Nms_per_rad[j] * v;
    known_Nm[j] = motion.torque_Nm[j] - friction_Nm + now.drift[j] - weight_Nm[j];
  }
  if (!motion.usable || !core::all_finite(now.momentum, count) || !core::all_finite(known_Nm, count)) {
    restart();
    return external_;
  }
  if (started_ && dt_s > 0.0 && std::isfinite(dt_s)) {
    if (!reloaded) follow(now.momentum, known_Nm, dt_s);
    age_s_ += dt_s;
    external_.contact = contact_.step(greatest_share(), dt_s);
  }
  momentum_ = now.momentum;
  started_ = true;
  external_.measured = age_s_ >= kSettleLags * parameters_.lag_s;
  if (!external_.measured) {
    external_.contact = false;
    contact_.release();
    return external_;
  }
  for (std::size_t j = 0; j < count; ++j) {
    const double threshold_Nm = parameters_.threshold_Nm[j];
    external_.torque_Nm[j] = residual_Nm_[j] - std::clamp(residual_Nm_[j], -threshold_Nm, threshold_Nm);
  }
  return external_;
}

}  // namespace phantom::teleop
