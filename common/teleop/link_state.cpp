#include "common/teleop/link_state.hpp"

#include <algorithm>
#include <cmath>

namespace phantom::teleop {

const char* name_of(LinkState state) noexcept {
  switch (state) {
    case LinkState::kInit:
      return "init";
    case LinkState::kReady:
      return "ready";
    case LinkState::kAligned:
      return "aligned";
    case LinkState::kCoupled:
      return "coupled";
    case LinkState::kDegraded:
      return "degraded";
    case LinkState::kStopped:
      return "stopped";
  }
  return "unknown";
}

const char* name_of(StopCause cause) noexcept {
  switch (cause) {
    case StopCause::kNone:
      return "";
    case StopCause::kEmergency:
      return "emergency stop";
    case StopCause::kDriveFault:
      return "drives in fault";
  }
  return "unknown";
}

LinkState next_link_state(LinkState state, const LinkConditions& c) noexcept {
  if (c.stop) return LinkState::kStopped;
  const bool partner_aligned = c.partner == LinkState::kAligned || c.partner == LinkState::kCoupled;
  switch (state) {
    case LinkState::kInit:
      return c.partner_fresh ? LinkState::kReady : LinkState::kInit;
    case LinkState::kReady:
      if (!c.partner_fresh) return LinkState::kInit;
      return c.aligned ? LinkState::kAligned : LinkState::kReady;
    case LinkState::kAligned:
      if (!c.partner_fresh) return LinkState::kInit;
      if (!c.aligned) return LinkState::kReady;
      return partner_aligned ? LinkState::kCoupled : LinkState::kAligned;
    case LinkState::kCoupled:
      return c.partner_fresh && partner_aligned ? LinkState::kCoupled : LinkState::kDegraded;
    case LinkState::kDegraded:
      return c.recovered ? LinkState::kReady : LinkState::kDegraded;
    case LinkState::kStopped:
      return c.reset ? LinkState::kInit : LinkState::kStopped;
  }
  return LinkState::kStopped;
}

core::ComponentState component_state(LinkState link) noexcept {
  switch (link) {
    case LinkState::kCoupled:
      return core::ComponentState::kRunning;
    case LinkState::kDegraded:
      return core::ComponentState::kDegraded;
    case LinkState::kStopped:
      return core::ComponentState::kStopped;
    default:
      return core::ComponentState::kReady;
  }
}

LinkState LinkMonitor::step(const LinkObservation& seen, double dt_s) noexcept {
  const bool fresh = seen.drives_follow && !seen.answers_another &&
                     seen.partner_age_s <= timing_.staleness_s &&
                     seen.round_trip_s <= timing_.round_trip_limit_s;  // false for NaN too
  fresh_s_ = fresh ? fresh_s_ + dt_s : 0.0;
  agree_s_ = fresh && seen.poses_agree ? agree_s_ + dt_s : 0.0;
  const LinkState before = state_;
  // A stop that was asked for and released between two ticks still stops for one.
  const bool emergency = seen.requests.pending() || seen.requests.stops != stops_seen_;
  const bool stop = emergency || seen.drive_fault;
  stops_seen_ = seen.requests.stops;
  state_ = next_link_state(state_, {.partner_fresh = fresh,
                                    .aligned = agree_s_ > timing_.align_hold_s,
                                    .recovered = fresh_s_ > timing_.recovery_s,
                                    .stop = stop,
                                    .reset = !stop,
                                    .partner = seen.partner});
  stop_cause_ = emergency ? StopCause::kEmergency : stop ? StopCause::kDriveFault : StopCause::kNone;
  // Time that the partner was fresh before the loss says nothing about its recovery.
  if (state_ == LinkState::kDegraded && before != LinkState::kDegraded) fresh_s_ = 0.0;
  return state_;
}

double pose_difference(const core::JointArray& a, const core::JointArray& b,
                       const core::JointArray& tolerance, std::size_t joint_count) noexcept {
  double greatest = 0.0;
  for (std::size_t j = 0; j < joint_count; ++j) {
    const double difference = std::abs(a[j] - b[j]) / tolerance[j];
    if (std::isnan(difference)) return std::numeric_limits<double>::infinity();
    greatest = std::max(greatest, difference);
  }
  return greatest;
}

}  // namespace phantom::teleop
