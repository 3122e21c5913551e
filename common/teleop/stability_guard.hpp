#pragma once

#include <cstddef>

#include "common/core/joints.hpp"

namespace phantom::teleop {

/// Greatest damping that a sampled device of `inertia` m renders stably without a hand on it:
/// B_max = (2m/T)·tan(π/(4(n+1))), with `period_s` T and n `delay_samples` between measuring and acting
/// beyond the hold itself (computation, bus, velocity filter). N·m·s/rad or N·s/m. Real-time safe: yes.
double damping_stability_limit(double inertia, double period_s, int delay_samples) noexcept;

/// What of that limit may be used: half of it, to leave room for what the model leaves out (flexible links,
/// friction that falls with speed, a loose grip).
inline constexpr double kUsableShareOfDampingLimit = 0.5;

/// Samples of delay that a first-order velocity filter stands for: its time constant in whole samples,
/// rounded up.
int filter_delay_samples(double filter_s, double period_s) noexcept;

/// Device data that decide how much damping each joint may render.
struct DeviceDamping {
  std::size_t joint_count = 0;
  core::JointArray inertia{};      ///< kg·m² or kg
  core::JointArray damping_cap{};  ///< the device's own cap from its data sheet, N·m·s/rad or N·s/m
  double period_s = 0.001;
  int delay_samples = 1;  ///< all of them: command delay and velocity filter
};

/// Per joint the lesser of half the stability limit and the device's cap.
core::JointArray usable_damping(const DeviceDamping& device) noexcept;

}  // namespace phantom::teleop
