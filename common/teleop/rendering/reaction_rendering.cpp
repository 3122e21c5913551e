#include "common/teleop/rendering/reaction_rendering.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {
namespace {

bool is_sound(const robot::JointReaction& reaction, std::size_t count) noexcept {
  return core::all_finite(reaction.torque, count) && core::all_finite(reaction.position, count) &&
         core::all_finite(reaction.stiffness, count) &&
         std::all_of(reaction.stiffness.begin(),
                     reaction.stiffness.begin() + static_cast<std::ptrdiff_t>(count),
                     [](double stiffness) { return stiffness >= 0.0; });
}

}  // namespace

ReactionRenderer::ReactionRenderer(const ReactionParameters& parameters)
    : parameters_(parameters), authority_(parameters.ramp_up_s, parameters.ramp_down_s) {}

// Torque, stiffness and position pass the same filter, so that a spring that does not change stays what it
// is.
void ReactionRenderer::follow(double share) noexcept {
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    now_.torque[j] += share * (aim_.torque[j] - now_.torque[j]);
    now_.stiffness[j] += share * (aim_.stiffness[j] - now_.stiffness[j]);
    now_.position[j] += share * (aim_.position[j] - now_.position[j]);
  }
}

core::JointArray ReactionRenderer::step(const robot::JointReaction& reaction, bool fresh,
                                        const core::JointArray& q, double dt_s) noexcept {
  const std::size_t count = parameters_.joint_count;
  const bool usable = fresh && is_sound(reaction, count);
  const bool was_off = authority_.value() == 0.0;
  const double authority = authority_.step(usable, dt_s);
  if (usable) {
    aim_ = reaction;
    for (std::size_t j = 0; j < count; ++j) {
      aim_.torque[j] *= parameters_.gain;
      aim_.stiffness[j] = std::min(parameters_.gain * reaction.stiffness[j], parameters_.stiffness_limit[j]);
    }
  }
  follow(was_off ? 1.0 : dt_s / (dt_s + parameters_.smoothing_s));
  core::JointArray torque{};
  if (authority == 0.0 || !core::all_finite(q, count)) return torque;
  for (std::size_t j = 0; j < count; ++j) {
    const double here = now_.torque[j] - now_.stiffness[j] * (q[j] - now_.position[j]);
    torque[j] = authority * (now_.torque[j] > 0.0 ? std::max(0.0, here) : std::min(0.0, here));
    if (now_.torque[j] == 0.0) torque[j] = 0.0;
  }
  return torque;
}

}  // namespace phantom::teleop
