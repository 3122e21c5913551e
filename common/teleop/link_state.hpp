#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "common/core/health.hpp"
#include "common/core/joints.hpp"
#include "common/teleop/stop_latch.hpp"

namespace phantom::teleop {

/// How far master and slave have come together. Numbered as in the topics' LinkState.
enum class LinkState {
  kInit,      ///< no valid partner yet: no torque, the slave holds
  kReady,     ///< partner heard; poses are being brought together
  kAligned,   ///< poses agree; waiting for the partner to say the same
  kCoupled,   ///< the slave follows the master
  kDegraded,  ///< the partner went stale or let go: torques fade out, the slave holds
  kStopped,   ///< a stop is in force (StopCause): stays until a reset names it
};

const char* name_of(LinkState state) noexcept;

/// Everything a transition depends on.
struct LinkConditions {
  bool partner_fresh = false;  ///< the partner's newest valid sample is younger than the staleness limit
  bool aligned = false;        ///< the poses have agreed within tolerance for the hold time
  bool recovered = false;      ///< the partner has been fresh for the recovery time
  bool stop = false;           ///< a stop is in force
  LinkState partner =
      LinkState::kInit;  ///< what the partner says of itself; means something while it is fresh
};

/// The transition table, the same for master and slave. Coupling needs both sides aligned, so recovery too
/// leads through an aligned pose. A stop wins over everything. A partner that is stopped is as good as none:
/// nobody aligns or couples with it. Real-time safe: yes.
LinkState next_link_state(LinkState state, const LinkConditions& conditions) noexcept;

/// How a component whose link is in this state tells its health: coupled is running, waiting and aligning are
/// ready.
core::ComponentState component_state(LinkState link) noexcept;

struct LinkTiming {
  double staleness_s = 0.02;         ///< the partner counts as stale beyond this age
  double round_trip_limit_s = 0.15;  ///< and when what it says answers something of ours older than this
  double align_hold_s = 0.05;        ///< the poses must agree this long
  double recovery_s = 0.2;           ///< after a loss the partner must be fresh this long
};

/// What the loop knows in one tick.
struct LinkObservation {
  double partner_age_s =
      std::numeric_limits<double>::infinity();  ///< of its newest valid sample, since it came; ∞: none yet
  double round_trip_s =
      0.0;  ///< since our own newest stamp that it echoes was made; 0: it echoes none of ours yet
  bool answers_another = false;  ///< what it says answers another process in our place: it is not our partner
  LinkState partner = LinkState::kInit;
  StopId partner_stop = 0;  ///< names the partner's stop, while it is stopped
  bool poses_agree = false;
  std::uint32_t stop_requests = 0;   ///< emergency stops that were asked for so far
  const StopReset* reset = nullptr;  ///< one that came since the last tick
  bool drives_follow =
      true;  ///< false: this side's drives do not do what they are told, so nothing is coupled
  bool drive_fault = false;
};

/// What one tick decides.
struct LinkDecision {
  LinkState state = LinkState::kInit;
  StopRecord stop;  ///< in force
  ResetOutcome reset = ResetOutcome::kNone;
  /// Drives may have power: no stop is in force, and the partner was heard and said that it is not stopped.
  bool power = false;
  /// A stop has been in force for kConfirmWithin_s, and the partner has not said since that it is stopped. Of
  /// a stop that was kept from before the start, the time counts from when the partner is heard.
  bool partner_unconfirmed = false;
};

inline constexpr double kConfirmWithin_s = core::seconds(core::kStopConfirmedWithin_ns);

/// The table with its stop, watchdog and timers. Ages come in from a monotonic clock: it never relies on DDS
/// events. A sample that comes regularly but late is found by the echo of our own stamps: no clock of two
/// hosts is compared.
class LinkMonitor {
 public:
  /// `latch`: with the stop that outlived the process before this one, if there is one.
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
  StopId watched_stop_ = 0;  // whose confirmation by the partner is waited for
  double watched_s_ = 0.0;
  bool confirmed_ = false, since_start_ = false;
};

/// Greatest |a − b| ÷ tolerance over the joints: at most 1 while the poses agree; ∞ if a position is not a
/// number. Real-time safe: yes.
double pose_difference(const core::JointArray& a, const core::JointArray& b,
                       const core::JointArray& tolerance, std::size_t joint_count) noexcept;

}  // namespace phantom::teleop
