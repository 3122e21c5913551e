#include "common/teleop/feedback_rendering.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {

FeedbackRenderer::FeedbackRenderer(const FeedbackParameters& parameters)
    : parameters_(parameters),
      authority_(parameters.ramp_up_s, parameters.ramp_down_s),
      contact_(parameters.contact_rise_s, parameters.contact_fall_s),
      passivity_(parameters.passivity),
      law_(parameters.law),
      inverse_a_(parameters.inverse_a[static_cast<std::size_t>(parameters.law)]) {}

// Moves 1/A to what is wished for; returns it with the contact's share.
double FeedbackRenderer::follow_gain(const FeedbackInputs& in, double dt_s) noexcept {
  const double own = parameters_.inverse_a[static_cast<std::size_t>(law_)];
  const double wished =
      in.law == law_ && in.inverse_a >= 0.0 && std::isfinite(in.inverse_a) ? in.inverse_a : own;
  if (authority_.value() == 0.0) {
    inverse_a_ = wished;  // nothing is felt: no need to wait
  } else {
    // From one law's gain to another's, or from nothing to 1, within the ramp's time.
    const double furthest = std::max(1.0, own) / parameters_.ramp_up_s * dt_s;
    inverse_a_ += std::clamp(wished - inverse_a_, -furthest, furthest);
  }
  const double touched = contact_.step(in.contact && in.coupled, dt_s);
  return inverse_a_ * (1.0 + (parameters_.contact_gain_ratio - 1.0) * touched);
}

RenderedFeedback FeedbackRenderer::step(const FeedbackInputs& in, double dt_s) noexcept {
  RenderedFeedback out;
  out.force_missing = needs_force_sensor(law_) && !in.force_measured;
  const double authority = authority_.step(in.coupled && in.law == law_ && !out.force_missing, dt_s);
  if (authority == 0.0) law_ = in.law;
  out.law = law_;
  out.inverse_a = follow_gain(in, dt_s);
  if (in.coupled) {
    coupled_Nm_ = feedback_torque(law_, in.master, in.slave, in.effort, parameters_.exchange, out.inverse_a,
                                  parameters_.joint_count);
  }
  core::JointArray torque_Nm{};
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    const double cap_Nm = parameters_.torque_cap_Nm[j];
    if (std::isfinite(coupled_Nm_[j])) torque_Nm[j] = authority * std::clamp(coupled_Nm_[j], -cap_Nm, cap_Nm);
  }
  out.torque_Nm = passivity_.step(torque_Nm, in.master.position, in.master.velocity, authority, dt_s);
  out.passivity_limited = passivity_.active();
  return out;
}

}  // namespace phantom::teleop
