#include "components/master_io/master_io.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::master_io {

using teleop::LinkState;

MasterIo::MasterIo(const Config& config)
    : count_(config.device.joint_count),
      law_(config.law),
      align_tolerance_(config.align_tolerance),
      torque_limit_Nm_(config.device.torque_limit_Nm),
      feedback_cap_Nm_(config.feedback.torque_cap_Nm),
      percept_staleness_s_(config.percept_staleness_s),
      link_(config.link),
      percept_(config.percept),
      feedback_authority_(config.feedback.ramp_up_s, config.feedback.ramp_down_s),
      feedback_gain_(config.feedback.inverse_a),
      gain_slew_per_s_(1.0 / config.feedback.ramp_up_s) {}

MasterOutputs MasterIo::step(const MasterInputs& in, double dt_s) noexcept {
  MasterOutputs out;
  const bool agree = teleop::pose_difference(in.slave.position, in.position, align_tolerance_, count_) <= 1.0;
  out.state = link_.step({.partner_age_s = in.slave_age_s,
                          .partner = in.slave.state,
                          .poses_agree = agree,
                          .requests = in.wishes.requests},
                         dt_s);
  const bool coupled = out.state == LinkState::kCoupled;
  out.percept_enabled = in.percept_wanted && in.wishes.percept_enabled;
  const bool fresh = in.drag_age_s <= percept_staleness_s_;
  const auto percept = percept_.step(in.drag.drag, fresh, coupled && out.percept_enabled,
                                     in.wishes.percept_gain, in.velocity, dt_s);
  out.percept_Nm = percept.torque_Nm;
  out.percept_gain = fresh ? percept.gain : in.wishes.percept_gain;
  out.damping_limited = percept.damping_limited;
  out.torque_limited = percept.torque_limited;
  out.feedback_Nm = render_feedback(in, coupled, dt_s);
  out.feedback_gain = feedback_gain_;
  out.motor_Nm = teleop::master_torque(out.percept_Nm, out.feedback_Nm, torque_limit_Nm_, count_);
  return out;
}

core::JointArray MasterIo::render_feedback(const MasterInputs& in, bool coupled, double dt_s) noexcept {
  const double furthest = gain_slew_per_s_ * dt_s;
  feedback_gain_ += std::clamp(in.wishes.feedback_gain - feedback_gain_, -furthest, furthest);
  const double authority = feedback_authority_.step(coupled, dt_s);
  auto torque_Nm = teleop::feedback_torque(law_, {in.slave.loop_torque_Nm}, feedback_gain_, count_);
  for (std::size_t j = 0; j < count_; ++j) {
    torque_Nm[j] = authority * std::clamp(torque_Nm[j], -feedback_cap_Nm_[j], feedback_cap_Nm_[j]);
  }
  return torque_Nm;
}

}  // namespace phantom::master_io
