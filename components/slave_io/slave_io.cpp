#include "components/slave_io/slave_io.hpp"

#include <algorithm>
#include <cmath>

#include "common/robot/kinematics/tool_wrench.hpp"

namespace phantom::slave_io {

using teleop::LinkState;

namespace {

core::JointArray limits_of(const robot::SerialArm& arm, double robot::Joint::*limit) {
  core::JointArray values{};
  for (std::size_t j = 0; j < arm.joint_count(); ++j) values[j] = arm.joints()[j].*limit;
  return values;
}

// Longest time for which the reference continues by itself: bridges a late sample, not a lost link.
constexpr double kMaxHold_s = 0.003;

bool holds(LinkState state) {
  return state == LinkState::kInit || state == LinkState::kDegraded || state == LinkState::kStopped;
}

}  // namespace

SlaveIo::SlaveIo(const robot::SerialArm& arm, const Config& config, const core::JointArray& start_q,
                 const teleop::StopLatch& latch)
    : arm_(arm),
      count_(arm.joint_count()),
      tool_force_bound_N_(config.contact_limit.tool_force_N),
      bounds_(config.object_bounds, config.link_boxes),
      lower_(limits_of(arm, &robot::Joint::lower)),
      upper_(limits_of(arm, &robot::Joint::upper)),
      max_speed_(limits_of(arm, &robot::Joint::max_speed)),
      align_tolerance_(config.align_tolerance),
      align_speed_(config.align_speed),
      align_range_(config.align_range),
      link_(config.link, latch),
      servo_(arm.joint_count(), config.gains, config.held),
      weight_(config.plant.balanced, config.gravity_feed_forward),
      limiter_(arm.joint_count(), lower_, upper_),
      contact_limit_(config.contact_limit) {
  limiter_.reset(start_q);
}

SlaveOutputs SlaveIo::step(const SlaveInputs& in, double dt_s) noexcept {
  const LinkState before = link_.state();
  SlaveOutputs out{teleop::step_link(link_, in, in.master, align_tolerance_, count_, dt_s)};
  if ((holds(out.state) && !holds(before)) || !in.drives_operational) limiter_.reset(in.position);
  if (out.state != LinkState::kCoupled || !in.drives_operational) contact_limit_.reset();
  const bool comes = out.state == LinkState::kReady || out.state == LinkState::kAligned;
  out.far_joint = comes ? far_joint(in.master.position) : std::int8_t{-1};
  out.reference_velocity = lead_reference(in, out.far_joint < 0, dt_s);
  out.pressing_joint = static_cast<std::int8_t>(contact_limit_.held_joint());
  out.pressing_tool = contact_limit_.held_by_tool();
  out.pressing_object = contact_limit_.held_by_object();
  out.pressed_object = out.pressing_object ? bounding_object_ : std::uint16_t{0};
  out.touches_it = in.contact_object != 0;
  out.pressing_effort = contact_limit_.held_force();
  out.reference = limiter_.reference();
  out.weight_Nm = weight_.step(in.counterbalance, in.gravity_Nm, dt_s);
  out.counterbalance = weight_.in_force();
  out.torque =
      servo_.step(out.reference, out.reference_velocity, in.position, in.velocity, out.weight_Nm, in.loop);
  limit_speed(in.velocity, out.torque.drive_Nm);
  return out;
}

teleop::ContactForce SlaveIo::contact_force(const SlaveInputs& in) noexcept {
  teleop::ContactForce force{in.force_measured, in.external_Nm, 0.0, 0.0, 0.0};
  if (!in.force_measured) return force;
  const bool is_known = in.contact_force_N >= 0.0;
  if (is_known) force.object_force_N = in.contact_force_N;
  const bool asks_bound = in.contact && !bounds_.empty();
  if (tool_force_bound_N_ <= 0.0 && !asks_bound) return force;
  robot::LinkPoses X_WL;
  arm_.link_poses(in.position, X_WL);
  if (asks_bound) {
    const ForceBounds::Bound bound = bounds_.of(in.contact_object, X_WL);
    force.object_bound_N = bound.force_N;
    bounding_object_ = bound.object;
  }
  if (tool_force_bound_N_ <= 0.0 && (force.object_bound_N <= 0.0 || is_known)) return force;
  force.tool_force_N = robot::tool_force_N(arm_, X_WL, in.external_Nm);
  if (!is_known) force.object_force_N = force.tool_force_N;
  return force;
}

// A joint above its speed limit gets no torque that would make it faster.
void SlaveIo::limit_speed(const core::JointArray& v, core::JointArray& drive_Nm) const noexcept {
  for (std::size_t j = 0; j < count_; ++j) {
    if (v[j] > max_speed_[j]) drive_Nm[j] = std::min(drive_Nm[j], 0.0);
    if (v[j] < -max_speed_[j]) drive_Nm[j] = std::max(drive_Nm[j], 0.0);
  }
}

// Moves the reference as the link's state allows. Returns the reference's velocity.
core::JointArray SlaveIo::lead_reference(const SlaveInputs& in, bool master_near, double dt_s) noexcept {
  core::JointArray v_ref{};
  switch (link_.state()) {
    case LinkState::kInit:
    case LinkState::kDegraded:
    case LinkState::kStopped:
      break;
    case LinkState::kReady:
    case LinkState::kAligned:
      if (master_near) limiter_.step(as_far_as_free(in), align_speed_, dt_s);
      break;
    case LinkState::kCoupled: {
      // Between samples the reference continues at the master's velocity. The two loops run unsynchronised,
      // and a reference that waited for the next sample would jitter with their phase.
      core::JointArray target = in.master.position;
      const double hold_s = std::clamp(in.partner_age_s, 0.0, kMaxHold_s);
      for (std::size_t j = 0; j < count_; ++j) {
        // At a limit the reference stands still, whatever the master's velocity is.
        const bool free = target[j] > lower_[j] && target[j] < upper_[j];
        if (free && std::isfinite(in.master.velocity[j])) {
          v_ref[j] = std::clamp(in.master.velocity[j], -max_speed_[j], max_speed_[j]);
          target[j] += v_ref[j] * hold_s;
        }
      }
      const core::JointArray allowed =
          contact_limit_.step(target, limiter_.reference(), contact_force(in), dt_s);
      for (std::size_t j = 0; j < count_; ++j) {
        if (allowed[j] != target[j]) v_ref[j] = 0.0;
      }
      limiter_.step(allowed, max_speed_, dt_s);
      break;
    }
  }
  return v_ref;
}

// Returns the master's pose, except for a joint that is blocked: its reference is not moved further ahead,
// because nobody feels the force in this state.
core::JointArray SlaveIo::as_far_as_free(const SlaveInputs& in) const noexcept {
  core::JointArray target = in.master.position;
  const core::JointArray& reference = limiter_.reference();
  for (std::size_t j = 0; j < count_; ++j) {
    const double ahead = reference[j] - in.position[j];
    if (std::abs(ahead) > align_tolerance_[j] && (target[j] - reference[j]) * ahead > 0.0)
      target[j] = reference[j];
  }
  return target;
}

// Returns the first joint whose reference is farther from q than the arm aligns by itself, or whose q is NaN;
// −1: none.
std::int8_t SlaveIo::far_joint(const core::JointArray& q) const noexcept {
  for (std::size_t j = 0; j < count_; ++j) {
    if (!(std::abs(q[j] - limiter_.reference()[j]) <= align_range_[j])) return static_cast<std::int8_t>(j);
  }
  return -1;
}

}  // namespace phantom::slave_io
