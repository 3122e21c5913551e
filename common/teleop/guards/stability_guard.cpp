#include "common/teleop/guards/stability_guard.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace phantom::teleop {

double damping_stability_limit(double inertia, double period_s, double delay_samples) noexcept {
  return 2.0 * inertia / period_s * std::tan(std::numbers::pi / (4.0 * (delay_samples + 1.0)));
}

int filter_delay_samples(double filter_s, double period_s) noexcept {
  return static_cast<int>(std::ceil(filter_s / period_s - 1e-9));
}

double damping_share(double delay_samples, double more_samples) noexcept {
  return damping_stability_limit(1.0, 1.0, delay_samples + more_samples) /
         damping_stability_limit(1.0, 1.0, delay_samples);
}

core::JointArray usable_damping(const DeviceDamping& device) noexcept {
  core::JointArray limit{};
  for (std::size_t j = 0; j < device.joint_count; ++j) {
    const double stable = damping_stability_limit(device.inertia[j], device.period_s, device.delay_samples);
    limit[j] = std::min(kUsableShareOfDampingLimit * stable, device.damping_cap[j]);
  }
  return limit;
}

}  // namespace phantom::teleop
