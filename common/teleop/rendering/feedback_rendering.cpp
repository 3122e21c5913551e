#include "common/teleop/rendering/feedback_rendering.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {

FeedbackRenderer::FeedbackRenderer(const FeedbackParameters& parameters)
    : parameters_(parameters),
      authority_(parameters.ramp_up_s, parameters.ramp_down_s),
      contact_(parameters.contact_rise_s, parameters.contact_fall_s),
      passivity_(parameters.passivity),
      law_(parameters.law),
      inverse_a_(parameters.inverse_a[static_cast<std::size_t>(parameters.law)]),
      round_trip_s_(parameters.expected_round_trip_s) {}

// Ignores a single late sample, but follows a link that has become slower.
void FeedbackRenderer::follow_delay(double measured_s, double dt_s) noexcept {
  if (!(measured_s > 0.0)) return;
  const double seen_s = std::min(measured_s, FeedbackLimits::kMax_s);
  const double constant_s = seen_s > round_trip_s_ ? kDelayRise_s : kDelayFall_s;
  round_trip_s_ += dt_s / (dt_s + constant_s) * (seen_s - round_trip_s_);
}

// Moves 1/A towards the requested value, scales it by the contact's share and limits it to the stable value.
void FeedbackRenderer::follow_gain(const FeedbackInputs& in, double dt_s, RenderedFeedback& out) noexcept {
  const core::JointArray& own = parameters_.inverse_a[static_cast<std::size_t>(law_)];
  const double touched = contact_.step(in.contact && in.coupled, dt_s);
  const double share = 1.0 + (parameters_.contact_gain_ratio - 1.0) * touched;
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    const double asked = in.inverse_a[j];
    const double wanted = in.law == law_ && asked >= 0.0 && std::isfinite(asked) ? asked : own[j];
    if (authority_.value() == 0.0) {
      inverse_a_[j] = wanted;  // nothing is rendered, so a jump is not felt
    } else {
      // The ramp's time covers a change from one law's gain to another's, or from 0 to 1.
      const double furthest = std::max(1.0, own[j]) / parameters_.ramp_up_s * dt_s;
      inverse_a_[j] += std::clamp(wanted - inverse_a_[j], -furthest, furthest);
    }
    const double stable = parameters_.limits.usable(law_, j, round_trip_s_);
    out.inverse_a[j] = std::min(inverse_a_[j] * share, stable);
    out.limited = out.limited || inverse_a_[j] * share > stable;
  }
}

RenderedFeedback FeedbackRenderer::step(const FeedbackInputs& in, double dt_s) noexcept {
  RenderedFeedback out;
  out.force_missing = needs_force_sensor(law_) && !in.force_measured;
  const double authority = authority_.step(in.coupled && in.law == law_ && !out.force_missing, dt_s);
  if (authority == 0.0) law_ = in.law;
  out.law = law_;
  follow_delay(in.round_trip_s, dt_s);
  out.round_trip_s = round_trip_s_;
  follow_gain(in, dt_s, out);
  if (in.coupled && !out.force_missing) {  // else what was felt last fades
    coupled_Nm_ = feedback_torque(law_, in.master, in.slave, in.effort, parameters_.exchange, out.inverse_a,
                                  parameters_.joint_count);
  }
  core::JointArray torque_Nm{};
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    const double cap_Nm = parameters_.torque_cap_Nm[j];
    const double slave_Nm = std::isfinite(coupled_Nm_[j]) ? coupled_Nm_[j] : 0.0;
    const double reaction_Nm = std::isfinite(in.reaction_Nm[j]) ? in.reaction_Nm[j] : 0.0;
    out.torque_limited = out.torque_limited || (authority > 0.0 && std::abs(slave_Nm + reaction_Nm) > cap_Nm);
    torque_Nm[j] = authority * std::clamp(slave_Nm + reaction_Nm, -cap_Nm, cap_Nm);
  }
  out.torque_Nm =
      passivity_.step(torque_Nm, in.master.position, in.master.velocity, in.limit_share * authority, dt_s);
  for (std::size_t j = 0; j < parameters_.joint_count; ++j) {
    const double cap_Nm = parameters_.torque_cap_Nm[j];
    out.torque_limited = out.torque_limited || std::abs(out.torque_Nm[j]) > cap_Nm;
    out.torque_Nm[j] = std::clamp(out.torque_Nm[j], -cap_Nm, cap_Nm);
  }
  passivity_.note_rendered(out.torque_Nm);
  out.passivity_limited = passivity_.active();
  return out;
}

}  // namespace phantom::teleop
