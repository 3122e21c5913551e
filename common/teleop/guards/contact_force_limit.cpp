#include "common/teleop/guards/contact_force_limit.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {
namespace {
constexpr double kHeld = 0.9;    // r from which on an arm that does not go on counts as held at its bound
constexpr double kBears = 0.01;  // share of its bound from which on a joint bears some of the tool's force
}  // namespace

// Returns r, and notes whose it is.
double ContactForceLimit::greatest_ratio(const ContactForce& force) noexcept {
  double greatest = 0.0;
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    const double torque = std::abs(force.external_Nm[j]), bound = parameters_.torque_Nm[j];
    if (bound <= 0.0 || !(torque / bound > greatest) || !std::isfinite(torque)) continue;
    greatest = torque / bound;
    held_joint_ = static_cast<int>(j), held_force_ = torque;
  }
  const double tool = parameters_.tool_force_N > 0.0 ? force.tool_force_N / parameters_.tool_force_N : 0.0;
  if (tool > greatest && std::isfinite(tool)) {
    greatest = tool;
    held_by_tool_ = true, held_force_ = force.tool_force_N;
  }
  const double object = force.object_bound_N > 0.0 ? force.object_force_N / force.object_bound_N : 0.0;
  if (object > greatest && std::isfinite(object)) {
    greatest = object;
    held_by_tool_ = false, held_by_object_ = true, held_force_ = force.object_force_N;
  }
  return greatest;
}

bool ContactForceLimit::bears(std::size_t joint, double external_Nm) const noexcept {
  return std::abs(external_Nm) > kBears * parameters_.torque_Nm[joint];
}

core::JointArray ContactForceLimit::step(const core::JointArray& target, const core::JointArray& reference,
                                         const ContactForce& force, double dt_s) noexcept {
  core::JointArray allowed = target;
  forget_held();
  const double ratio = force.measured ? greatest_ratio(force) : 0.0;
  bool held = false;
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    Stop& stop = stops_[j];
    const double external = force.measured ? force.external_Nm[j] : 0.0;
    // The surroundings push against the way that the joint presses.
    if (stop.way == 0 && ratio >= 1.0 && bears(j, external) && external * (target[j] - reference[j]) <= 0.0)
      stop = {external > 0.0 ? -1 : 1, reference[j]};
    if (stop.way == 0) continue;
    const bool opposes = bears(j, external) && external * stop.way < 0.0;
    const double towards = opposes ? std::clamp(1.0 - ratio, -1.0, 1.0) : 1.0;
    if (force.measured) stop.at += stop.way * parameters_.yield_speed[j] * towards * dt_s;
    if (!(stop.way * (target[j] - stop.at) > 0.0)) {
      stop = {};
      continue;
    }
    allowed[j] = stop.at;
    held = held || (opposes && ratio > kHeld);
  }
  if (!held) forget_held();
  return allowed;
}

}  // namespace phantom::teleop
