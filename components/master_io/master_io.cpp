#include "components/master_io/master_io.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::master_io {

using teleop::LinkState;

MasterIo::MasterIo(const Config& config)
    : count_(config.device.joint_count),
      contact_source_(config.contact_source),
      align_tolerance_(config.align_tolerance),
      torque_limit_Nm_(config.device.torque_limit_Nm),
      percept_staleness_s_(config.percept_staleness_s),
      round_trip_limit_s_(config.link.round_trip_limit_s),
      link_(config.link),
      percept_(config.percept),
      feedback_(config.feedback) {}

MasterOutputs MasterIo::step(const MasterInputs& in, double dt_s) noexcept {
  MasterOutputs out;
  const bool agree =
      teleop::pose_difference(in.slave.motion.position, in.position, align_tolerance_, count_) <= 1.0;
  out.state = link_.step({.partner_age_s = in.slave_age_s,
                          .round_trip_s = in.slave_round_trip_s,
                          .answers_another = in.slave.answers_another,
                          .partner = in.slave.state,
                          .poses_agree = agree,
                          .requests = in.wishes.requests,
                          .drives_follow = in.drives_follow,
                          .drive_fault = in.drive_fault},
                         dt_s);
  out.stop_cause = link_.stop_cause();
  out.slave_elsewhere = in.slave.answers_another;
  out.slave_touches = in.slave.contact;
  const bool coupled = out.state == LinkState::kCoupled;
  out.percept_enabled = in.percept_wanted && in.wishes.percept_enabled;
  const bool fresh = in.drag_age_s <= percept_staleness_s_ && in.drag_round_trip_s <= round_trip_limit_s_;
  const auto percept = percept_.step(in.drag.drag, fresh, coupled && out.percept_enabled,
                                     in.wishes.percept_gain, in.velocity, dt_s);
  out.percept_Nm = percept.torque_Nm;
  out.percept_gain = fresh ? percept.gain : in.wishes.percept_gain;
  out.damping_limited = percept.damping_limited;
  out.torque_limited = percept.torque_limited;
  render_feedback(in, dt_s, out);
  out.motor_Nm = teleop::master_torque(out.percept_Nm, out.feedback_Nm, torque_limit_Nm_, count_);
  return out;
}

void MasterIo::render_feedback(const MasterInputs& in, double dt_s, MasterOutputs& out) noexcept {
  // A phantom's contact outlives a percept period, not much more.
  constexpr double kPhantomStaleness_s = 0.1;
  const bool sensed = contact_source_ != ContactSource::kPhantom && in.slave.contact;
  const bool predicted = contact_source_ != ContactSource::kSlave && in.phantom.contact &&
                         in.phantom_age_s <= kPhantomStaleness_s;
  const auto felt = feedback_.step({.law = in.wishes.law,
                                    .inverse_a = in.wishes.feedback_gain,
                                    .coupled = out.state == LinkState::kCoupled,
                                    .contact = sensed || predicted,
                                    .force_measured = in.slave.force_measured,
                                    .master = {in.position, in.velocity},
                                    .slave = in.slave.motion,
                                    .effort = in.slave.effort},
                                   dt_s);
  out.feedback_Nm = felt.torque_Nm;
  out.feedback_gain = felt.inverse_a;
  out.law = felt.law;
  out.feedback_damped = felt.passivity_limited;
  out.force_missing = felt.force_missing;
}

}  // namespace phantom::master_io
