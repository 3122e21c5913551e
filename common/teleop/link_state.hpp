#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>

#include "common/core/health.hpp"
#include "common/core/joints.hpp"

namespace phantom::teleop {

/// How far master and slave have come together. Numbered as in the topics' LinkState.
enum class LinkState {
  kInit,      ///< no valid partner yet: no torque, the slave holds
  kReady,     ///< partner heard; poses are being brought together
  kAligned,   ///< poses agree; waiting for the partner to say the same
  kCoupled,   ///< the slave follows the master
  kDegraded,  ///< the partner went stale or let go: torques fade out, the slave holds
  kStopped,   ///< emergency stop or drives in fault (StopCause): stays until reset
};

/// Why a side is stopped. Numbered as in the topics' StopCause.
enum class StopCause {
  kNone,        ///< it is not
  kEmergency,   ///< somebody asked for it
  kDriveFault,  ///< its own drives are in fault
};

const char* name_of(LinkState state) noexcept;
/// In words: "", "emergency stop", "drives in fault".
const char* name_of(StopCause cause) noexcept;

/// Everything a transition depends on.
struct LinkConditions {
  bool partner_fresh = false;  ///< the partner's newest valid sample is younger than the staleness limit
  bool aligned = false;        ///< the poses have agreed within tolerance for the hold time
  bool recovered = false;      ///< the partner has been fresh for the recovery time
  bool stop = false;           ///< there is a StopCause
  bool reset = false;          ///< there is none any more, and a reset was asked for
  LinkState partner =
      LinkState::kInit;  ///< what the partner says of itself; means something while it is fresh
};

/// The transition table, the same for master and slave. Coupling needs both sides aligned, so recovery too
/// leads through an aligned pose. A stop wins over everything; while its cause is there, a reset does
/// nothing. Real-time safe: yes.
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

/// Emergency stops and resets as people asked for them, as one value that may be read late: no stop is ever
/// missed, and a reset releases the stops that came before it, never one that came after.
struct StopRequests {
  std::uint32_t stops = 0;     ///< asked for so far
  std::uint32_t released = 0;  ///< of them, those that a reset has answered
  std::uint32_t resets = 0;    ///< asked for so far: drives in fault leave it at each

  void stop() noexcept { ++stops; }
  void reset() noexcept {
    released = stops;
    ++resets;
  }
  bool pending() const noexcept { return stops != released; }
};

/// What the loop knows in one tick.
struct LinkObservation {
  double partner_age_s =
      std::numeric_limits<double>::infinity();  ///< of its newest valid sample, since it came; ∞: none yet
  double round_trip_s =
      0.0;  ///< since our own newest stamp that it echoes was made; 0: it echoes none of ours yet
  bool answers_another = false;  ///< what it says answers another process in our place: it is not our partner
  LinkState partner = LinkState::kInit;
  bool poses_agree = false;
  StopRequests requests;
  bool drives_follow =
      true;  ///< false: this side's drives do not do what they are told, so nothing is coupled
  bool drive_fault = false;  ///< stops for as long as it is there
};

/// The table with its watchdog and timers. Ages come in from a monotonic clock: it never relies on DDS
/// events. A sample that comes regularly but late is found by the echo of our own stamps: no clock of two
/// hosts is compared.
class LinkMonitor {
 public:
  explicit LinkMonitor(const LinkTiming& timing) : timing_(timing) {}

  /// Real-time safe: yes.
  LinkState step(const LinkObservation& seen, double dt_s) noexcept;
  LinkState state() const noexcept { return state_; }
  StopCause stop_cause() const noexcept { return stop_cause_; }

 private:
  LinkTiming timing_;
  LinkState state_ = LinkState::kInit;
  StopCause stop_cause_ = StopCause::kNone;
  double agree_s_ = 0.0, fresh_s_ = 0.0;
  std::uint32_t stops_seen_ = 0;
};

/// Greatest |a − b| ÷ tolerance over the joints: at most 1 while the poses agree; ∞ if a position is not a
/// number. Real-time safe: yes.
double pose_difference(const core::JointArray& a, const core::JointArray& b,
                       const core::JointArray& tolerance, std::size_t joint_count) noexcept;

}  // namespace phantom::teleop
