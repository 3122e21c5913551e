#include "common/simulation/master_plant.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::simulation {

MasterPlant::MasterPlant(const MasterPlantParameters& parameters, const core::JointArray& start_q)
    : parameters_(parameters),
      encoders_(parameters.joint_count, parameters.encoder_resolution, parameters.velocity_filter_s),
      q_(start_q) {
  encoders_.sample(q_, 0.0);
}

void MasterPlant::step(const core::JointArray& hand_Nm, const core::JointArray& motor_Nm,
                       double dt_s) noexcept {
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    const double hand = std::isfinite(hand_Nm[j]) ? hand_Nm[j] : 0.0;
    integrate(parameters_.joints[j], hand + pending_Nm_[j], dt_s, q_[j], v_[j]);
    const double limit = parameters_.torque_limit_Nm[j];
    pending_Nm_[j] = std::isfinite(motor_Nm[j]) ? std::clamp(motor_Nm[j], -limit, limit) : 0.0;
  }
  encoders_.sample(q_, dt_s);
}

}  // namespace phantom::simulation
