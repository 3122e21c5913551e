#include "components/master_io/master_io.hpp"

#include <algorithm>
#include <cmath>

#include "common/teleop/guards/stability_guard.hpp"

namespace phantom::master_io {

using teleop::LinkState;

namespace {

// Drag never has to give energy: what its sum seems to give in free motion is the encoders' and filters'
// error. A soft body gives back what it took: a deep press on it is a joule.
constexpr double kPerceptAllowance_J = 0.02, kPerceptStore_J = 0.02;
constexpr double kReactionAllowance_J = 0.05, kReactionStore_J = 1.0;

double least(const core::JointArray& values, std::size_t count) noexcept {
  return *std::min_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(count));
}

// Whether the slave's answers arrive; the age of earlier ones does not measure the link's delay.
bool hears(LinkState state) noexcept {
  return state == LinkState::kReady || state == LinkState::kAligned || state == LinkState::kCoupled;
}

// A spring that acts late by t gives the hand what a damping of −K·t does; the passivity guard may add the
// damping that the device renders stably.
core::JointArray stiffness_limit(const teleop::PerceptParameters& percept, double late_s) noexcept {
  core::JointArray limit{};
  for (std::size_t j = 0; j < percept.joint_count; ++j)
    limit[j] = percept.damping_limit_Nms_per_rad[j] / late_s;
  return limit;
}

}  // namespace

MasterIo::MasterIo(const Config& config, const teleop::StopLatch& latch)
    : count_(config.device.joint_count),
      contact_source_(config.contact_source),
      align_tolerance_(config.align_tolerance),
      percept_staleness_s_(config.percept_staleness_s),
      round_trip_limit_s_(config.link.round_trip_limit_s),
      period_s_(config.period_s),
      delay_samples_(config.command_delay_samples +
                     teleop::filter_delay_samples(config.device.velocity_filter_s, config.period_s)),
      link_(config.link, latch),
      percept_(config.percept),
      reaction_({.joint_count = config.device.joint_count,
                 .gain = config.reaction_gain,
                 .stiffness_limit = stiffness_limit(config.percept, (delay_samples_ + 1.0) * period_s_),
                 .smoothing_s = config.percept.smoothing_s,
                 .ramp_up_s = config.feedback.ramp_up_s,
                 .ramp_down_s = config.feedback.ramp_down_s}),
      feedback_(config.feedback),
      percept_tank_({config.device.joint_count, kPerceptAllowance_J, kPerceptStore_J}),
      reaction_tank_({config.device.joint_count, kReactionAllowance_J, kReactionStore_J}),
      slew_({.joint_count = config.device.joint_count,
             .mode = config.percept.mode,
             .percept_cap_Nm = config.percept.torque_cap_Nm,
             .feedback_cap_Nm = config.feedback.torque_cap_Nm,
             .limit_Nm = config.device.torque_limit_Nm,
             .rate_Nm_per_s = config.torque_rate_Nm_per_s}),
      masking_(config.masking) {}

void MasterIo::step(const MasterInputs& in, double dt_s, MasterReport& report) noexcept {
  MasterOutputs& out = report.outputs =
      MasterOutputs{teleop::step_link(link_, in, in.slave, align_tolerance_, count_, dt_s)};
  report.state = out.state;
  report.stop = out.stop;
  report.switch_fitted = out.enabling != teleop::SwitchState::kNotFitted;
  report.motion_permitted = teleop::permits(out.enabling);
  out.slave_touches = in.slave.contact;
  const bool coupled = out.state == LinkState::kCoupled;
  out.percepts = in.settings.percepts;
  report.drag_chosen = out.percepts.drag;
  report.tone_enabled = out.percepts.tone;
  report.views_enabled = out.percepts.views;
  report.percept_set_automatic = out.percepts.automatic;
  report.percept_enabled = in.percept_wanted && out.percepts.drag;
  out.counterbalance = in.slave.counterbalance;
  feedback_.note_share(in.rendered_share);
  percept_tank_.note_share(in.rendered_share);
  reaction_tank_.note_share(in.rendered_share);
  const bool fresh = in.drag_age_s <= percept_staleness_s_ && in.drag_round_trip_s <= round_trip_limit_s_;
  const double limit_share = teleop::damping_share(delay_samples_, in.device_longer_s / period_s_);
  auto percept = percept_.step(in.drag.drag, fresh, coupled && report.percept_enabled,
                               in.settings.percept_gain, in.velocity, dt_s, limit_share);
  report.percept_gain = fresh ? percept.gain : least(in.settings.percept_gain, count_);
  if (!coupled && percept.authority == 0.0) percept_tank_.reset();
  percept.torque_Nm = percept_tank_.step(percept.torque_Nm, in.position, dt_s);
  out.damping_limited = percept.damping_limited || percept_tank_.active();
  const auto asked_Nm =
      reaction_.step(in.drag.reaction, fresh && in.drag.drag.valid && coupled, in.position, dt_s);
  if (!coupled && asked_Nm == core::JointArray{}) reaction_tank_.reset();
  const auto reaction_Nm = reaction_tank_.step(asked_Nm, in.position, dt_s);
  render_feedback(in, reaction_Nm, limit_share, dt_s, report);
  // Stable gains are inversely proportional to the time that a torque acts unchanged.
  const double share = in.loop.share_within(teleop::kPunctual * period_s_);
  for (std::size_t j = 0; j < count_; ++j) {
    percept.torque_Nm[j] *= share;
    report.feedback_torque_Nm[j] *= share;
  }
  const teleop::SlewedTorque& felt =
      slew_.step(percept.torque_Nm, report.feedback_torque_Nm, in.velocity, dt_s);
  out.percept_capped = percept.torque_limited || felt.percept_capped;
  out.feedback_capped = out.feedback_capped || felt.feedback_capped;
  report.percept_limited = out.damping_limited || out.percept_capped;
  report.percept_torque_Nm = felt.percept_Nm;
  report.feedback_torque_Nm = felt.feedback_Nm;
  out.motor_Nm = felt.motor_Nm;
  judge_masking(in, reaction_Nm, dt_s, report);
  feedback_.note_rendered(felt.feedback_Nm);
  percept_tank_.note_rendered(felt.percept_Nm);
  report.feedback_damped = report.feedback_damped || reaction_tank_.active();
  const auto some = [](double torque_Nm) { return torque_Nm != 0.0; };
  out.power = out.power || std::any_of(out.motor_Nm.begin(), out.motor_Nm.end(), some);
}

bool MasterIo::touches(const MasterInputs& in) const noexcept {
  const bool sensed = contact_source_ != ContactSource::kPhantom && in.slave.contact;
  const bool predicted = contact_source_ != ContactSource::kSlave && in.phantom.contact &&
                         in.phantom_age_s <= kPhantomStaleness_s;
  return sensed || predicted;
}

// A soft body's reaction is a contact, too.
void MasterIo::judge_masking(const MasterInputs& in, const core::JointArray& reaction_Nm, double dt_s,
                             MasterReport& report) noexcept {
  if (report.state != LinkState::kCoupled)
    masking_.reset();
  else if (report.percept_enabled && !touches(in) && reaction_Nm == core::JointArray{})
    masking_.step(report.percept_torque_Nm, report.feedback_torque_Nm, dt_s);
  report.outputs.drag_masked = masking_.masked();
}

void MasterIo::render_feedback(const MasterInputs& in, const core::JointArray& reaction_Nm,
                               double limit_share, double dt_s, MasterReport& report) noexcept {
  const double link_s = hears(report.state) ? in.partner_round_trip_s : 0.0;
  const auto felt = feedback_.step({.law = in.settings.law,
                                    .inverse_a = in.settings.feedback_gain,
                                    .coupled = report.state == LinkState::kCoupled,
                                    .contact = touches(in),
                                    .force_measured = in.slave.force_measured,
                                    .round_trip_s = link_s > 0.0 ? link_s + in.device_longer_s : 0.0,
                                    .limit_share = limit_share,
                                    .master = {in.position, in.velocity},
                                    .slave = {in.slave.position, in.slave.velocity},
                                    .effort = {in.slave.loop_torque_Nm, in.slave.external_torque_Nm},
                                    .reaction_Nm = reaction_Nm},
                                   dt_s);
  report.feedback_torque_Nm = felt.torque_Nm;
  report.feedback_gain = least(felt.inverse_a, count_);
  report.outputs.feedback_delay_s = felt.round_trip_s;
  report.feedback_limited = felt.limited;
  report.law = felt.law;
  report.feedback_damped = felt.passivity_limited;
  report.outputs.feedback_capped = felt.torque_limited;
  report.force_missing = felt.force_missing;
}

}  // namespace phantom::master_io
