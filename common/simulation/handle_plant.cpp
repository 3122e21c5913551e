#include "common/simulation/handle_plant.hpp"

#include <algorithm>

namespace phantom::simulation {
namespace {

core::JointArray steps_of(const HandlePlantParameters& p) {
  core::JointArray steps{};
  for (std::size_t i = 0; i < 6; ++i) steps[i] = i < 3 ? p.encoder_step_m : p.encoder_step_rad;
  return steps;
}

}  // namespace

HandlePlant::HandlePlant(const HandlePlantParameters& parameters)
    : parameters_(parameters), encoders_(6, steps_of(parameters), parameters.velocity_filter_s) {
  encoders_.sample(travelled_, 0.0);
}

void HandlePlant::step(const robot::Spatial& hand, const robot::Spatial& motors, double dt_s) noexcept {
  const Eigen::Vector3d turned = geometry::rotation_vector(pose_.rotation);
  JointMechanics free = parameters_.turned;  // its end stop is that of the whole rotation, below
  free.lower = -1e9, free.upper = 1e9;
  Eigen::Vector3d turn;
  for (int i = 0; i < 6; ++i) {
    const double force = pending_[i] + (hand.allFinite() ? hand[i] : 0.0);
    double& travelled = travelled_[static_cast<std::size_t>(i)];
    double q = i < 3 ? pose_.translation_m[i] : 0.0;
    const double before = q;
    integrate(i < 3 ? parameters_.moved : free, force, dt_s, q, v_[i]);
    travelled += q - before;
    (i < 3 ? pose_.translation_m[i] : turn[i - 3]) = q;
  }
  const Eigen::Matrix3d rotation = geometry::rotation_from_vector(turn) * pose_.rotation;
  if (geometry::rotation_vector(rotation).norm() > std::max(parameters_.turned.upper, turned.norm())) {
    v_.tail<3>().setZero();
    for (std::size_t i = 0; i < 3; ++i) travelled_[i + 3] -= turn[static_cast<int>(i)];
  } else {
    pose_.rotation = rotation;
  }
  const double force_N = parameters_.force_limit_N, moment_N_m = parameters_.moment_limit_N_m;
  if (!motors.allFinite()) {
    pending_.setZero();
  } else {
    pending_.head<3>() = motors.head<3>().cwiseMax(-force_N).cwiseMin(force_N);
    pending_.tail<3>() = motors.tail<3>().cwiseMax(-moment_N_m).cwiseMin(moment_N_m);
  }
  encoders_.sample(travelled_, dt_s);
}

robot::Spatial HandlePlant::twist() const noexcept {
  robot::Spatial twist;
  for (int i = 0; i < 6; ++i) twist[i] = encoders_.velocity()[static_cast<std::size_t>(i)];
  return twist;
}

}  // namespace phantom::simulation
