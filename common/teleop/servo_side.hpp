#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "common/core/clock.hpp"
#include "common/core/joints.hpp"
#include "common/core/stop_requests.hpp"
#include "common/teleop/link_state.hpp"
#include "common/teleop/stop_latch.hpp"

// What the servos of master and slave do alike.

namespace phantom::teleop {

/// What a controller is told of the link and of its own drives, on either side.
struct SideInputs {
  double partner_age_s =
      std::numeric_limits<double>::infinity();  ///< since its newest valid sample was received; ∞: none yet
  double partner_round_trip_s = 0.0;  ///< since what it answers was made here; 0: it answers none of ours yet
  std::uint32_t stop_requests = 0;    ///< emergency stops that were asked for so far
  const StopReset* reset = nullptr;   ///< one that came since the last tick
  core::JointArray position{};        ///< as the encoders say
  core::JointArray velocity{};
  bool drives_follow = true;  ///< false: they do not do what they are told (power off, starting, stopped)
  bool drive_fault = false;   ///< they need a reset
};

/// What a controller decides of the link, on either side.
struct SideOutputs {
  LinkState state = LinkState::kInit;
  StopRecord stop;  ///< in force
  ResetOutcome reset = ResetOutcome::kNone;
  bool power = false;                ///< the drives may have power
  bool partner_unconfirmed = false;  ///< stopped for a while, and the partner does not say that it is stopped
  bool partner_elsewhere = false;    ///< the partner is heard, but answers another process in our place
};

/// One step of the link with a partner (messages::Answer of its state). Real-time safe: yes.
template <class Partner>
SideOutputs step_link(LinkMonitor& link, const SideInputs& in, const Partner& partner,
                      const core::JointArray& align_tolerance, std::size_t joint_count,
                      double dt_s) noexcept {
  const auto decision = link.step(
      {.partner_age_s = in.partner_age_s,
       .round_trip_s = in.partner_round_trip_s,
       .answers_another = partner.answers_another,
       .partner = partner.state,
       .partner_stop = partner.stop.id,
       .poses_agree = pose_difference(partner.position, in.position, align_tolerance, joint_count) <= 1.0,
       .stop_requests = in.stop_requests,
       .reset = in.reset,
       .drives_follow = in.drives_follow,
       .drive_fault = in.drive_fault},
      dt_s);
  return {decision.state,         decision.stop, decision.reset, decision.power, decision.partner_unconfirmed,
          partner.answers_another};
}

/// A servo thread's dealings with who asks for stops and resets, and with what keeps the stop in force.
/// Real-time safe: yes, all of it.
class StopExchange {
 public:
  /// Both must outlive it.
  StopExchange(core::StopRequests& requests, StopStore& store) noexcept
      : requests_(requests), store_(store), kept_(store.read()) {}

  /// At the start of a tick: what was asked for until now. `signals`: emergency stops that signals asked for.
  /// Returns how many stops the requests hold.
  std::uint32_t begin(SideInputs& in, std::uint32_t signals) noexcept {
    const std::uint32_t stops = requests_.stops();
    in.stop_requests = stops + signals;
    if (in.reset == nullptr && requests_.take(reset_)) in.reset = &reset_.names;
    return stops;
  }
  /// After each step: keeps the stop, before anything acts on it, and tells what became of a reset. Returns
  /// whether the stop was released.
  bool end(SideInputs& in, const SideOutputs& out) noexcept {
    const bool released = out.reset == ResetOutcome::kReleased;
    if (out.stop != kept_) store_.write(kept_ = out.stop);
    if (in.reset != nullptr) requests_.give_result({reset_.number, released});
    in.reset = nullptr;
    return released;
  }

 private:
  core::StopRequests& requests_;
  StopStore& store_;
  StopRecord kept_;
  core::StopRequests::Reset reset_;
};

/// Brings the age of the partner's newest sample, and of what it answers, up to `now_ns`. Real-time safe:
/// yes.
template <class Partner>
void age_partner(SideInputs& in, const Partner& partner, core::Nanoseconds now_ns) noexcept {
  if (partner.received_ns != 0) in.partner_age_s = core::seconds(now_ns - partner.received_ns);
  in.partner_round_trip_s = partner.answers_ns != 0 ? core::seconds(now_ns - partner.answers_ns) : 0.0;
}

/// Periods that a loop missed are made up for up to so many, so that what is simulated keeps real time.
inline constexpr int kMostMadeUp = 10;

/// The steps of one tick of `dt_s`.
struct TickSteps {
  int count = 1;
  double step_s = 0.0;
};
/// `one_by_one`: missed periods are lived through one after the other; else in one step. Real-time safe: yes.
inline TickSteps steps_of_tick(double dt_s, double period_s, bool one_by_one) noexcept {
  const int missed = static_cast<int>(std::clamp(std::round(dt_s / period_s), 1.0, double{kMostMadeUp}));
  const int count = one_by_one ? missed : 1;
  return {count, period_s * missed / count};
}

}  // namespace phantom::teleop
