#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "common/core/clock.hpp"
#include "common/core/joints.hpp"
#include "common/teleop/commands/stop_requests.hpp"
#include "common/teleop/coupling/enabling_switch.hpp"
#include "common/teleop/coupling/link_state.hpp"
#include "common/teleop/coupling/stop_latch.hpp"
#include "common/teleop/guards/loop_guard.hpp"

// Code that the servos of master and slave share.

namespace phantom::teleop {

/// Inputs of a controller about the link and its own drives, the same for master and slave.
struct SideInputs {
  double partner_age_s = std::numeric_limits<double>::infinity();  ///< age of the partner's newest valid
                                                                   ///< sample since its receipt; ∞: none yet
  double partner_round_trip_s = 0.0;  ///< age of our sample that the partner answers; 0: it answers none yet
  std::uint32_t stop_requests = 0;    ///< emergency stops requested so far
  const StopReset* reset = nullptr;   ///< the reset that arrived since the last tick; null: none
  core::JointArray position{};        ///< as measured by the encoders
  core::JointArray velocity{};
  bool drives_operational =
      true;                  ///< false: they do not follow their commands (power off, starting, stopped)
  bool drive_fault = false;  ///< they need a reset
  SwitchState enabling = SwitchState::kNotFitted;  ///< this side's enabling switch
  LoopPace loop;  ///< how regularly this side's ticks come, if its drives are real
};

/// Decisions of a controller about the link, the same for master and slave.
struct SideOutputs {
  LinkState state = LinkState::kInit;
  StopRecord stop;  ///< in force
  ResetOutcome reset = ResetOutcome::kNone;
  bool power = false;                 ///< the drives may have power
  bool partner_unconfirmed = false;   ///< stopped for a while without the partner's report that it is stopped
  bool peer_bound_elsewhere = false;  ///< the partner is heard but answers another process in our place
  bool peer_has_other_model = false;  ///< the partner is heard and works with another arm or cell
  bool peer_motion_inhibited = false;              ///< the partner is heard and does not permit motion
  SwitchState enabling = SwitchState::kNotFitted;  ///< as it was given
  LoopPace loop;                                   ///< as it was given
};

/// Returns whether the link waits for an enabling switch, of this side or of the partner.
inline bool waits_for_switch(const SideOutputs& now) noexcept {
  const bool waits = now.state == LinkState::kInit || now.state == LinkState::kDegraded;
  return waits && (!permits(now.enabling) || now.peer_motion_inhibited);
}

/// Returns the component's state: that of the link, or of the enabling switch that the link waits for.
inline core::ComponentState component_state(const SideOutputs& now) noexcept {
  return waits_for_switch(now) ? component_state(now.enabling) : component_state(now.state);
}

/// Returns one sentence on the enabling switch that the link waits for. `partner`: "master" or "slave". Not
/// real-time safe.
inline std::string switch_sentence(const SideOutputs& now, const std::string& partner) {
  constexpr const char* kSwitch = "enabling switch ";
  if (permits(now.enabling)) return "the " + partner + "'s " + kSwitch + "is not held: the arm holds";
  return std::string(kSwitch) + reason_of(now.enabling) + ": the arm holds";
}

/// Steps the link's state by one tick. `partner`: the partner's state as received (messages::Answer).
/// Real-time safe: yes.
template <class Partner>
SideOutputs step_link(LinkMonitor& link, const SideInputs& in, const Partner& partner,
                      const core::JointArray& align_tolerance, std::size_t joint_count,
                      double dt_s) noexcept {
  const auto decision = link.step(
      {.partner_age_s = in.partner_age_s,
       .round_trip_s = in.partner_round_trip_s,
       .echoes_other_session = partner.echoes_other_session,
       .other_model = partner.other_model,
       .partner = partner.state,
       .partner_stop = partner.stop.id,
       .poses_agree = pose_difference(partner.position, in.position, align_tolerance, joint_count) <= 1.0,
       .stop_requests = in.stop_requests,
       .reset = in.reset,
       .drives_operational = in.drives_operational,
       .drive_fault = in.drive_fault,
       .permitted = permits(in.enabling),
       .partner_permitted = partner.motion_permitted,
       .loop_starved = in.loop.starved},
      dt_s);
  return {.state = decision.state,
          .stop = decision.stop,
          .reset = decision.reset,
          .power = decision.power,
          .partner_unconfirmed = decision.partner_unconfirmed,
          .peer_bound_elsewhere = partner.echoes_other_session,
          .peer_has_other_model = partner.other_model,
          .peer_motion_inhibited = decision.peer_motion_inhibited,
          .enabling = in.enabling,
          .loop = in.loop};
}

/// Passes stop and reset requests to the servo thread, keeps the stop in force in the store and reports
/// results of resets. Real-time safe: yes, all of it.
class StopExchange {
 public:
  /// `requests` and `store` must outlive the object.
  StopExchange(teleop::StopRequests& requests, StopStore& store) noexcept
      : requests_(requests), store_(store), kept_(store.read()) {}

  /// Collects at the start of a tick what was requested until now. `signals`: emergency stops requested by
  /// signals. Returns the number of stops in the requests, without those of the signals.
  std::uint32_t begin(SideInputs& in, std::uint32_t signals) noexcept {
    const std::uint32_t stops = requests_.stops();
    in.stop_requests = stops + signals;
    if (in.reset == nullptr && requests_.take(reset_)) in.reset = &reset_.names;
    return stops;
  }
  /// Stores a changed stop after each step, before anything acts on it, and reports the result of a reset.
  /// Returns whether the stop was released.
  bool end(SideInputs& in, const SideOutputs& out) noexcept {
    const bool released = out.reset == ResetOutcome::kReleased;
    if (out.stop != kept_) store_.write(kept_ = out.stop);
    if (in.reset != nullptr) requests_.give_result({reset_.number, released});
    in.reset = nullptr;
    return released;
  }

 private:
  teleop::StopRequests& requests_;
  StopStore& store_;
  StopRecord kept_;
  teleop::StopRequests::Reset reset_;
};

/// Updates the age of the partner's newest sample, and of the sample that it answers, to `now_ns`. Real-time
/// safe: yes.
template <class Partner>
void age_partner(SideInputs& in, const Partner& partner, core::Nanoseconds now_ns) noexcept {
  if (partner.received_ns != 0) in.partner_age_s = core::seconds(now_ns - partner.received_ns);
  in.partner_round_trip_s = partner.answers_ns != 0 ? core::seconds(now_ns - partner.answers_ns) : 0.0;
}

/// Greatest number of missed periods that a loop makes up for, so that a simulation keeps real time.
inline constexpr int kMaxMadeUp = 10;

/// Number and length of the steps in one tick.
struct TickSteps {
  int count = 1;
  double step_s = 0.0;
};
/// Returns the steps of a tick of `dt_s`. `one_by_one`: each missed period is one step; else all are one
/// step. Real-time safe: yes.
inline TickSteps steps_of_tick(double dt_s, double period_s, bool one_by_one) noexcept {
  const int missed = static_cast<int>(std::clamp(std::round(dt_s / period_s), 1.0, double{kMaxMadeUp}));
  const int count = one_by_one ? missed : 1;
  return {count, period_s * missed / count};
}

}  // namespace phantom::teleop
