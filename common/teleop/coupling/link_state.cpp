#include "common/teleop/coupling/link_state.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace phantom::teleop {

const char* name_of(LinkState state) noexcept {
  constexpr std::array kNames{"init", "ready", "aligned", "coupled", "degraded", "stopped"};
  return kNames[static_cast<std::size_t>(state)];
}

LinkState next_link_state(LinkState state, const LinkConditions& c) noexcept {
  if (c.stop) return LinkState::kStopped;
  const bool fresh = c.partner_fresh && c.partner != LinkState::kStopped;
  const bool partner_aligned = c.partner == LinkState::kAligned || c.partner == LinkState::kCoupled;
  switch (state) {
    case LinkState::kInit:
      return fresh ? LinkState::kReady : LinkState::kInit;
    case LinkState::kReady:
      if (!fresh) return LinkState::kInit;
      return c.aligned ? LinkState::kAligned : LinkState::kReady;
    case LinkState::kAligned:
      if (!fresh) return LinkState::kInit;
      if (!c.aligned) return LinkState::kReady;
      return partner_aligned ? LinkState::kCoupled : LinkState::kAligned;
    case LinkState::kCoupled:
      return fresh && partner_aligned ? LinkState::kCoupled : LinkState::kDegraded;
    case LinkState::kDegraded:
      return c.recovered && fresh ? LinkState::kReady : LinkState::kDegraded;
    case LinkState::kStopped:
      return LinkState::kInit;
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

LinkMonitor::LinkMonitor(const LinkTiming& timing, const StopLatch& latch)
    : timing_(timing),
      latch_(latch),
      state_(latch.stopped() ? LinkState::kStopped : LinkState::kInit),
      watched_stop_(latch.record().id),
      since_start_(latch.stopped()) {}

// Counts from the newest stop. What the partner reported before that stop confirms nothing.
bool LinkMonitor::unconfirmed(bool partner_heard, bool partner_stopped, double dt_s) noexcept {
  if (stop().id != watched_stop_) {
    watched_stop_ = stop().id;
    watched_s_ = 0.0;
    confirmed_ = since_start_ = false;
  }
  if (watched_stop_ == 0) return false;
  confirmed_ = confirmed_ || partner_stopped;
  if (!since_start_ || partner_heard) watched_s_ += dt_s;
  return !confirmed_ && watched_s_ > kConfirmWithin_s;
}

LinkDecision LinkMonitor::step(const LinkObservation& seen, double dt_s) noexcept {
  const bool heard = std::isfinite(seen.partner_age_s);
  const bool partner_stopped = heard && seen.partner == LinkState::kStopped;
  const ResetOutcome outcome = latch_.step({.requests = seen.stop_requests,
                                            .drive_fault = seen.drive_fault,
                                            .partner_stopped = partner_stopped,
                                            .partner_stop = seen.partner_stop,
                                            .reset = seen.reset});
  const bool in_time = seen.partner_age_s <= timing_.staleness_s;  // false for NaN too
  const bool permitted = seen.permitted && seen.partner_permitted;
  const bool fresh = !seen.loop_starved && seen.drives_operational && !seen.echoes_other_session && in_time &&
                     permitted && !seen.other_model && seen.round_trip_s <= timing_.round_trip_limit_s;
  const bool usable = fresh && !partner_stopped;
  fresh_s_ = usable ? fresh_s_ + dt_s : 0.0;
  agree_s_ = usable && seen.poses_agree ? agree_s_ + dt_s : 0.0;
  const LinkState before = state_;
  state_ = next_link_state(state_, {.partner_fresh = fresh,
                                    .aligned = agree_s_ > timing_.align_hold_s,
                                    .recovered = fresh_s_ > timing_.recovery_s,
                                    .stop = latch_.stopped(),
                                    .partner = seen.partner});
  // The time for which the partner was fresh before the loss must not count as recovery.
  if (state_ == LinkState::kDegraded && before != LinkState::kDegraded) fresh_s_ = 0.0;
  return {state_,
          stop(),
          outcome,
          !seen.loop_starved && heard && !partner_stopped && !latch_.stopped(),
          unconfirmed(in_time, partner_stopped && in_time, dt_s),
          in_time && !seen.partner_permitted};
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
