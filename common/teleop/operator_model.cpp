#include "common/teleop/operator_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace phantom::teleop {

Progress minimum_jerk(double phase) noexcept {
  const double p = std::clamp(phase, 0.0, 1.0);
  return {p * p * p * (10.0 - 15.0 * p + 6.0 * p * p), 30.0 * p * p * (1.0 - p) * (1.0 - p)};
}

Progress constant_velocity(double phase, double ramp_share) noexcept {
  const double p = std::clamp(phase, 0.0, 1.0);
  const double speed = 1.0 / (1.0 - ramp_share);  // so that the whole way takes the whole phase
  if (p < ramp_share) return {0.5 * speed * p * p / ramp_share, speed * p / ramp_share};
  if (p > 1.0 - ramp_share)
    return {1.0 - 0.5 * speed * (1.0 - p) * (1.0 - p) / ramp_share, speed * (1.0 - p) / ramp_share};
  return {speed * (p - 0.5 * ramp_share), speed};
}

OperatorModel::OperatorModel(const OperatorParameters& parameters, const core::JointArray& start_q)
    : parameters_(parameters), from_(start_q), to_(start_q), reference_(start_q) {}

void OperatorModel::move_to(const core::JointArray& target_q, double duration_s) noexcept {
  from_ = reference_;
  to_ = target_q;
  duration_s_ = duration_s;
  phase_ = 0.0;
}

void OperatorModel::release(const core::JointArray& q) noexcept {
  from_ = to_ = reference_ = q;
  reference_v_ = {};
  phase_ = 1.0;
}

Progress OperatorModel::progress() const noexcept {
  return parameters_.kind == OperatorKind::kMinimumJerk
             ? minimum_jerk(phase_)
             : constant_velocity(phase_, parameters_.velocity_ramp_share);
}

const core::JointArray& OperatorModel::step(const core::JointArray& q, const core::JointArray& v, bool go,
                                            double dt_s) noexcept {
  const double phase_rate = go && phase_ < 1.0 ? pace_ / duration_s_ : 0.0;
  phase_ = std::min(1.0, phase_ + phase_rate * dt_s);
  const Progress now = progress();
  double load = 0.0;
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    const double way = to_[j] - from_[j];
    reference_[j] = from_[j] + way * now.share;
    reference_v_[j] = way * now.rate * phase_rate;
    const double wish =
        parameters_.stiffness[j] * (reference_[j] - q[j]) + parameters_.damping[j] * (reference_v_[j] - v[j]);
    torque_Nm_[j] = std::clamp(wish, -parameters_.max_force[j], parameters_.max_force[j]);
    load = std::max(load, std::abs(torque_Nm_[j]) / parameters_.max_force[j]);
  }
  if (parameters_.kind == OperatorKind::kMinimumJerk) {
    const double wish = std::clamp((1.0 - load) / (1.0 - parameters_.yield_share), 0.0, 1.0);
    const double share = dt_s / (dt_s + 1.0 / (2.0 * std::numbers::pi * parameters_.yield_bandwidth_Hz));
    pace_ += share * (wish - pace_);
  }
  return torque_Nm_;
}

}  // namespace phantom::teleop
