#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "common/core/health.hpp"
#include "common/core/joints.hpp"
#include "common/teleop/coupling/stop_latch.hpp"

namespace phantom::teleop {

/// State of the link between master and slave, from no partner to coupled. Numbered as in the topics'
/// LinkState.
enum class LinkState {
  kInit,      ///< no valid partner yet, or a side does not permit motion: no torque, the slave holds its pose
  kReady,     ///< the partner is heard; master and slave are being aligned
  kAligned,   ///< the poses agree; this side waits until the partner is aligned too
  kCoupled,   ///< the slave follows the master
  kDegraded,  ///< the partner is stale or has uncoupled, or a side no longer permits motion: torques fade
              ///< out, the slave holds its pose
  kStopped,   ///< a stop is in force (StopCause) until a reset names it
};

const char* name_of(LinkState state) noexcept;

/// What a transition of the link's state depends on.
struct LinkConditions {
  bool partner_fresh = false;  ///< the partner's newest valid sample is younger than the staleness limit,
                               ///< and both sides permit motion
  bool aligned = false;        ///< the poses have agreed within tolerance for the hold time
  bool recovered = false;      ///< the partner has been fresh for the recovery time
  bool stop = false;           ///< a stop is in force
  LinkState partner = LinkState::kInit;  ///< the partner's own state; valid only while the partner is fresh
};

/// Returns the state that follows `state` under `conditions`; master and slave use the same transition table.
/// Coupling needs both sides aligned, so recovery from a loss leads through alignment too. A stop takes
/// precedence over everything. A stopped partner counts as no partner: nobody aligns or couples with it.
/// Real-time safe: yes.
LinkState next_link_state(LinkState state, const LinkConditions& conditions) noexcept;

/// Returns the component's state that belongs to a link in state `link`: a coupled link is running; a link
/// that waits or aligns is ready.
core::ComponentState component_state(LinkState link) noexcept;

struct LinkTiming {
  double staleness_s = 0.02;         ///< the partner counts as stale when its newest sample is older
  double round_trip_limit_s = 0.15;  ///< and when the sample of ours that it answers is older
  double align_hold_s = 0.05;        ///< the poses must agree for this time
  double recovery_s = 0.2;           ///< after a loss the partner must be fresh for this time
};

/// Inputs of LinkMonitor for one tick.
struct LinkObservation {
  double partner_age_s = std::numeric_limits<double>::infinity();  ///< age of the partner's newest valid
                                                                   ///< sample since its receipt; ∞: none yet
  double round_trip_s = 0.0;  ///< age of our newest sample that the partner echoes; 0: it echoes none yet
  bool echoes_other_session =
      false;                 ///< the partner answers another process in our place, so it is not our partner
  bool other_model = false;  ///< the partner works with another arm or cell, so nothing is coupled with it
  LinkState partner = LinkState::kInit;
  StopId partner_stop = 0;  ///< identifies the partner's stop while it is stopped
  bool poses_agree = false;
  std::uint32_t stop_requests = 0;   ///< emergency stops requested so far
  const StopReset* reset = nullptr;  ///< the reset that arrived since the last tick; null: none
  bool drives_operational =
      true;  ///< false: this side's drives do not follow their commands, so nothing is coupled
  bool drive_fault = false;
  bool permitted = true;          ///< this side permits motion: its enabling switch is held, or it has none
  bool partner_permitted = true;  ///< the partner's newest sample says so of the partner
  bool loop_starved = false;  ///< this side's servo does not run often enough (LoopGuard): as a lost partner,
                              ///< and without power, because drives hold better by themselves
};

/// Decisions of LinkMonitor for one tick.
struct LinkDecision {
  LinkState state = LinkState::kInit;
  StopRecord stop;  ///< in force
  ResetOutcome reset = ResetOutcome::kNone;
  /// True if the drives may have power: no stop is in force, the servo runs often enough, and the partner was
  /// heard and reports that it is not stopped.
  bool power = false;
  /// True if a stop has been in force for kConfirmWithin_s and the partner has not reported since then that
  /// it is stopped. For a stop that was kept from before the start, the time counts only while the partner is
  /// fresh.
  bool partner_unconfirmed = false;
  bool peer_motion_inhibited = false;  ///< the partner is heard in time and does not permit motion
};

inline constexpr double kConfirmWithin_s = core::seconds(teleop::kStopConfirmedWithin_ns);

/// Runs the transition table with its stop latch, watchdog and timers. Ages come from a monotonic clock,
/// never from DDS events. A side that does not permit motion uncouples in that tick, and its partner in the
/// tick in which it hears of it; afterwards everything is as after a loss, so that coupling needs the
/// recovery time and aligned poses again. The echo of our own stamps reveals samples that arrive regularly
/// but late, so clocks of two hosts are never compared.
class LinkMonitor {
 public:
  /// `latch` holds the stop that was in force when the previous process ended, if there was one.
  LinkMonitor(const LinkTiming& timing, const StopLatch& latch);

  /// Real-time safe: yes.
  LinkDecision step(const LinkObservation& seen, double dt_s) noexcept;
  LinkState state() const noexcept { return state_; }
  const StopRecord& stop() const noexcept { return latch_.record(); }

 private:
  bool unconfirmed(bool partner_heard, bool partner_stopped, double dt_s) noexcept;

  LinkTiming timing_;
  StopLatch latch_;
  LinkState state_;
  double agree_s_ = 0.0, fresh_s_ = 0.0;
  StopId watched_stop_ = 0;  // the stop whose confirmation by the partner is awaited
  double watched_s_ = 0.0;
  bool confirmed_ = false, since_start_ = false;
};

/// Returns the greatest |a − b| ÷ tolerance over the joints: at most 1 while the poses agree, ∞ if a position
/// is NaN. Real-time safe: yes.
double pose_difference(const core::JointArray& a, const core::JointArray& b,
                       const core::JointArray& tolerance, std::size_t joint_count) noexcept;

}  // namespace phantom::teleop
