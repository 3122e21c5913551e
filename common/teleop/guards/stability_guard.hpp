#pragma once

#include <cstddef>

#include "common/core/joints.hpp"

namespace phantom::teleop {

/// Returns the greatest damping that a sampled device of `inertia` m renders stably without a hand on it:
/// B_max = (2m/T)·tan(π/(4(n+1))), in N·m·s/rad or N·s/m. T is `period_s`. n is `delay_samples`, the samples
/// between measurement and action beyond the hold itself (computation, bus, velocity filter); of a loop over
/// a network, its whole length ÷ T, less the hold. Real-time safe: yes.
double damping_stability_limit(double inertia, double period_s, double delay_samples) noexcept;

/// Returns the share, 0…1, of the limit with `delay_samples` that is left with `more_samples` ≥ 0 beyond
/// them. A sampling of the device that is slower than T allows more. Real-time safe: yes.
double damping_share(double delay_samples, double more_samples) noexcept;

/// Usable share of that limit. The other half is a margin for what the model leaves out (flexible links,
/// friction that falls with speed, a loose grip).
inline constexpr double kUsableShareOfDampingLimit = 0.5;

/// Returns the delay in samples that a first-order velocity filter amounts to: its time constant in whole
/// samples, rounded up.
int filter_delay_samples(double filter_s, double period_s) noexcept;

/// Device data that determine how much damping each joint may render.
struct DeviceDamping {
  std::size_t joint_count = 0;
  core::JointArray inertia{};      ///< kg·m² or kg
  core::JointArray damping_cap{};  ///< the device's own limit from its data sheet, N·m·s/rad or N·s/m
  double period_s = 0.001;
  int delay_samples = 1;  ///< in total: command delay and velocity filter
};

/// Returns for each joint the lesser of the usable share of the stability limit and the device's cap.
core::JointArray usable_damping(const DeviceDamping& device) noexcept;

}  // namespace phantom::teleop
