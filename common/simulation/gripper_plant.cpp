#include "common/simulation/gripper_plant.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::simulation {

GripperPlant::GripperPlant(const GripperPlantParameters& parameters, double start_width_m) noexcept
    : parameters_(parameters),
      mechanics_{.inertia = 0.5 * parameters.finger_mass_kg,
                 .viscous = parameters.viscous_Ns_per_m,
                 .coulomb = parameters.coulomb_N,
                 .lower = 0.0,
                 .upper = parameters.widest_m},
      width_m_(std::clamp(start_width_m, 0.0, parameters.widest_m)) {}

void GripperPlant::step(double demand_m, double greatest_force_N, double dt_s, double contact_N) noexcept {
  const int steps = std::max(1, static_cast<int>(std::lround(dt_s / kSubStep_s)));
  const double sub_s = dt_s / steps;
  const double most_N = std::isfinite(greatest_force_N) ? std::max(greatest_force_N, 0.0) : 0.0;
  if (!std::isfinite(contact_N)) contact_N = 0.0;
  const double damping_Ns_per_m = 2.0 * mechanics_.inertia * kBandwidth_rad_s;
  for (int k = 0; k < steps; ++k) {
    const double wanted_N =
        drive_stiffness_N_per_m() * (demand_m - width_m_) - damping_Ns_per_m * velocity_m_s_;
    drive_N_ = std::isfinite(wanted_N) ? std::clamp(wanted_N, -most_N, most_N) : 0.0;
    const double depth_m = parameters_.object_width_m - width_m_;
    object_force_N_ = depth_m <= 0.0 ? 0.0
                                     : std::max(0.0, parameters_.object_stiffness_N_per_m * depth_m -
                                                         parameters_.object_damping_Ns_per_m * velocity_m_s_);
    integrate(mechanics_, drive_N_ + object_force_N_ + contact_N, sub_s, width_m_, velocity_m_s_);
  }
}

}  // namespace phantom::simulation
