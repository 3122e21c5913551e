#include "common/simulation/operator_model.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

namespace phantom::simulation {

Progress minimum_jerk(double phase) noexcept {
  const double p = std::clamp(phase, 0.0, 1.0);
  return {p * p * p * (10.0 - 15.0 * p + 6.0 * p * p), 30.0 * p * p * (1.0 - p) * (1.0 - p)};
}

Progress constant_velocity(double phase, double ramp_share) noexcept {
  const double p = std::clamp(phase, 0.0, 1.0);
  const double speed = 1.0 / (1.0 - ramp_share);  // so that the whole path takes the whole phase
  if (p < ramp_share) return {0.5 * speed * p * p / ramp_share, speed * p / ramp_share};
  if (p > 1.0 - ramp_share)
    return {1.0 - 0.5 * speed * (1.0 - p) * (1.0 - p) / ramp_share, speed * (1.0 - p) / ramp_share};
  return {speed * (p - 0.5 * ramp_share), speed};
}

OperatorModel::OperatorModel(const OperatorParameters& parameters, const core::JointArray& start_q)
    : parameters_(parameters), from_(start_q), to_(start_q), reference_(start_q) {
  std::mt19937 random(parameters.seed);
  for (auto& joint : tremor_phase_) {
    for (double& phase : joint)
      phase = 2.0 * std::numbers::pi * (static_cast<double>(random()) / 4294967296.0);
  }
}

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

// Returns displacement and velocity of the reference's tremor.
Progress OperatorModel::tremor(std::size_t joint) const noexcept {
  constexpr double kSpread[kTremorSines] = {0.85, 1.0, 1.17};
  if (parameters_.tremor_rms[joint] == 0.0) return {};
  const double amplitude = parameters_.tremor_rms[joint] * std::sqrt(2.0 / kTremorSines);
  Progress shake;
  for (int k = 0; k < kTremorSines; ++k) {
    const double omega_rad_s = 2.0 * std::numbers::pi * parameters_.tremor_Hz * kSpread[k];
    const double angle = omega_rad_s * time_s_ + tremor_phase_[joint][static_cast<std::size_t>(k)];
    shake.share += amplitude * std::sin(angle);
    shake.rate += amplitude * omega_rad_s * std::cos(angle);
  }
  return shake;
}

double DelayedValue::step(double value, double delay_s, double dt_s) noexcept {
  newest_ = (newest_ + 1) % values_.size();
  values_[newest_] = static_cast<float>(value);
  const double ticks = std::min(delay_s, kMaxReaction_s) / dt_s;
  const auto late = static_cast<std::size_t>(std::clamp(ticks, 0.0, static_cast<double>(values_.size() - 1)));
  return static_cast<double>(values_[(newest_ + values_.size() - late) % values_.size()]);
}

namespace {

// Returns the pace at which a person goes on who notices `warning`.
double heeded_pace(const Attention& attention, double warning) noexcept {
  if (!(warning > attention.heed_from)) return 1.0;
  if (warning >= attention.creep_from) return attention.creep_pace;
  const double share = (warning - attention.heed_from) / (attention.creep_from - attention.heed_from);
  return 1.0 + share * (attention.creep_pace - 1.0);
}

}  // namespace

void OperatorModel::follow(double load, double dt_s) noexcept {
  const OperatorParameters& p = parameters_;
  const double felt = felt_load_.step(load, p.reaction_delay_s, dt_s);
  const double heard = heard_before_.step(heard_, p.hearing.reaction_delay_s, dt_s);
  const double seen = seen_before_.step(seen_, p.sight.reaction_delay_s, dt_s);
  const double wanted =
      std::min({std::clamp((p.stop_share - felt) / (p.stop_share - p.yield_share), 0.0, 1.0),
                heeded_pace(p.hearing, heard), heeded_pace(p.sight, seen)});
  const double bandwidth_Hz =
      wanted < pace_ ? parameters_.yield_bandwidth_Hz : parameters_.recovery_bandwidth_Hz;
  pace_ += dt_s / (dt_s + 1.0 / (2.0 * std::numbers::pi * bandwidth_Hz)) * (wanted - pace_);
}

const core::JointArray& OperatorModel::step(const core::JointArray& q, const core::JointArray& v, bool go,
                                            double dt_s) noexcept {
  const bool person = parameters_.kind == OperatorKind::kMinimumJerk;
  const double phase_rate = go && phase_ < 1.0 ? pace_ / duration_s_ : 0.0;
  phase_ = std::min(1.0, phase_ + phase_rate * dt_s);
  time_s_ += dt_s;
  const Progress now = progress();
  double load = 0.0;
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    const double way = to_[j] - from_[j];
    const Progress shake = person ? tremor(j) : Progress{};
    reference_[j] = from_[j] + way * now.share;
    reference_v_[j] = way * now.rate * phase_rate;
    const double wanted = parameters_.stiffness[j] * (reference_[j] + shake.share - q[j]) +
                          parameters_.damping[j] * (reference_v_[j] + shake.rate - v[j]);
    torque_Nm_[j] = std::clamp(wanted, -parameters_.max_force[j], parameters_.max_force[j]);
    load = std::max(load, std::abs(torque_Nm_[j]) / parameters_.max_force[j]);
  }
  if (person) follow(load, dt_s);
  return torque_Nm_;
}

}  // namespace phantom::simulation
